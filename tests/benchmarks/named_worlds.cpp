#include <string>
#include <vector>

#include "integrity_worlds.hpp"

namespace vantage::benchmarks {
namespace {

using Lines = std::vector<std::string>;

/// A level campus with a straight street of 120 m, which the drive takes as its second one.
Lines long_street(const std::string& layout) {
  return {"campus.layout=" + layout,     "campus.size_x=80.0",       "campus.size_y=240.0",
          "campus.street_spacing=120.0", "campus.street_jitter=0.0", "campus.ground_relief=0.0",
          "drive.length=130.0",          "drive.scan_every=6"};
}

/// A drive around the inner block, through both halves of the campus.
Lines around(Lines more = {}) {
  more.insert(more.end(), {"drive.length=240.0", "drive.scan_every=12"});
  return more;
}

Lines site(int metres, const std::string& point_spacing) {
  const std::string size = std::to_string(metres) + ".0";
  return {"campus.size_x=" + size, "campus.size_y=" + size, "map.point_spacing=" + point_spacing,
          "drive.route=1",         "drive.length=240.0",    "drive.scan_every=12"};
}

/// The patterns with fewer firings, as for the VLP-16.
const Lines kHdl64{"lidar.model=hdl64", "lidar.azimuth_step=1.0"};
const Lines kMid360{"lidar.model=mid360", "lidar.azimuth_step=1.3045"};

const std::vector<Scenario> kRepeatableAndLive = [] {
  std::vector<Scenario> all(kRepeatable.begin(), kRepeatable.end());
  all.push_back(Scenario::live);
  return all;
}();
const std::vector<Scenario> kNothingToFind{Scenario::odometry, Scenario::constant_velocity,
                                           Scenario::wrong_start};

Eigen::Matrix3d axes(const Eigen::Vector3d& x, const Eigen::Vector3d& y, const Eigen::Vector3d& z) {
  Eigen::Matrix3d rows;
  rows << x.transpose(), y.transpose(), z.transpose();
  return rows;
}

std::vector<NamedWorld> make_worlds() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  using simulation::SensorModel;
  return {
      {.name = "plain", .overrides = {}, .scenarios = kRepeatableAndLive},
      {.name = "half_covered",
       .overrides = {"lidar.covered_from=-180.0", "lidar.covered_to=0.0",
                     "lidar.disturbed_from=0.2"}},
      {.name = "cars_moved", .overrides = {"changes.moved_cars=1.0"}},
      {.name = "building_gone", .overrides = {"changes.buildings_gone=3"}},
      {.name = "building_new", .overrides = {"changes.buildings_new=2", "changes.fences_new=4"}},
      {.name = "leaves", .overrides = {"changes.leaves_gone=1.0"}},
      {.name = "clutter", .overrides = {"lidar.clutter=0.15"}},
      {.name = "rows",
       .overrides = long_street("rows"),
       .ambiguous = true,
       .scenarios = kRepeatableAndLive},
      {.name = "tunnel", .overrides = long_street("tunnel"), .ambiguous = true},
      {.name = "square",
       .overrides = {"campus.layout=square", "campus.size_x=150.0", "campus.size_y=150.0",
                     "campus.street_spacing=50.0", "campus.ground_relief=0.0",
                     "lidar.max_range=35.0", "drive.route=2", "drive.length=130.0",
                     "drive.scan_every=6"},
       .ambiguous = true},
      {.name = "kidnaps", .overrides = {"drive.length=90.0"}, .scenarios = {Scenario::kidnap}},
      {.name = "wrong_starts",
       .overrides = {},
       .scenarios = {Scenario::wrong_start},
       .wrong_starts = 12},

      // Sensors and how they move.
      {.name = "sweeps", .overrides = {"lidar.motion_distortion=true", "drive.scan_every=1"}},
      {.name = "stop_and_go",
       .overrides = {"lidar.motion_distortion=true", "drive.scan_every=2", "drive.still_start=2.0",
                     "drive.stops=3", "drive.turns_in_place=2", "drive.roughness=0.02"}},
      {.name = "fast",
       .overrides = {"lidar.motion_distortion=true", "drive.speed=8.0", "drive.acceleration=3.0",
                     "drive.stops=2", "drive.length=240.0", "drive.scan_every=2"},
       .scenarios = kRepeatableAndLive},
      {.name = "slopes",
       .overrides = {"campus.ground_relief=15.0", "lidar.roll=6.0", "lidar.pitch=-8.0"}},
      {.name = "tilted", .overrides = {"lidar.pitch=20.0"}},
      {.name = "hdl64", .overrides = kHdl64},
      {.name = "mid360", .overrides = kMid360},

      // Sites of other sizes.
      {.name = "site_250", .overrides = site(250, "0.25"), .wrong_starts = 2},
      {.name = "large",
       .overrides = {"campus.size_x=500.0", "campus.size_y=500.0", "map.point_spacing=0.4",
                     "drive.length=120.0"},
       .wrong_starts = 2},
      {.name = "site_800", .overrides = site(800, "0.5"), .wrong_starts = 2, .only_whole = true},

      // Maps.
      {.name = "map_by_hdl64", .overrides = {}, .map = {.surveyed_by = SensorModel::hdl64}},
      {.name = "map_by_mid360", .overrides = {}, .map = {.surveyed_by = SensorModel::mid360}},
      {.name = "hdl64_in_vlp16", .overrides = kHdl64, .map = {.surveyed_by = SensorModel::vlp16}},
      {.name = "mid360_in_hdl64", .overrides = kMid360, .map = {.surveyed_by = SensorModel::hdl64}},
      {.name = "doubled",
       .overrides = {},
       .ambiguous = true,
       .map = {.second_copy = {0.5, 0.5, 0.0}}},
      {.name = "doubled_far",
       .overrides = {},
       .ambiguous = true,
       .map = {.second_copy = {0.85, 0.85, 0.0}}},
      {.name = "bent",
       .overrides = around({"campus.size_x=240.0", "campus.size_y=240.0"}),
       .map = {.bend = 1.5}},
      {.name = "half_map", .overrides = around(), .ambiguous = true, .map = {.only_half = true}},

      // What is around the sensor.
      {.name = "crowd", .overrides = {"lidar.people=12"}},
      {.name = "dense_crowd", .overrides = {"lidar.people=40"}},
      {.name = "snow", .overrides = {"lidar.clutter=0.5", "lidar.dropout=0.2"}},
      {.name = "rebuilt_half", .overrides = around({"changes.rebuilt_half=true"})},

      // Where no pose is right, except for z_down: that of a sensor upside down.
      {.name = "other_place",
       .overrides = {},
       .ambiguous = true,
       .scenarios = kNothingToFind,
       .map = {.of_another_place = true}},
      {.name = "mirrored",
       .overrides = {},
       .ambiguous = true,
       .scenarios = kNothingToFind,
       .axes = axes(x, -y, z)},
      {.name = "xy_swapped",
       .overrides = {},
       .ambiguous = true,
       .scenarios = kNothingToFind,
       .axes = axes(y, x, z)},
      {.name = "yz_swapped",
       .overrides = {},
       .ambiguous = true,
       .scenarios = kNothingToFind,
       .axes = axes(x, z, y)},
      {.name = "z_down",
       .overrides = {},
       .ambiguous = true,
       .scenarios = kNothingToFind,
       .axes = axes(x, -y, -z)},
  };
}

}  // namespace

std::span<const NamedWorld> all_worlds() {
  static const std::vector<NamedWorld> worlds = make_worlds();
  return worlds;
}

}  // namespace vantage::benchmarks
