#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "simulate/lidar_params.hpp"
#include "vantage/params.hpp"

namespace vantage::simulation {

/// What stands between the streets.
enum class Layout : std::uint8_t { streets, rows, tunnel, square };
constexpr auto enum_names(Layout) {
  return std::array{std::pair{std::string_view("streets"), Layout::streets},
                    std::pair{std::string_view("rows"), Layout::rows},
                    std::pair{std::string_view("tunnel"), Layout::tunnel},
                    std::pair{std::string_view("square"), Layout::square}};
}

/// [campus]: what the campus contains.
struct CampusParams {
  Layout layout = Layout::streets;
  double tunnel_length = 60.0, square_radius = 40.0;
  double size_x = 80.0, size_y = 80.0;
  double origin_x = 0.0, origin_y = 0.0, origin_z = 0.0;
  double ground_relief = 2.0;
  double ground_cell = 1.0;
  double street_spacing = 40.0;
  double street_width = 7.0;
  double street_jitter = 2.0;
  double overpass_clearance = 4.5;
  double building_density = 0.35;
  double trees_per_hectare = 120.0;
  double parked_cars = 0.35;
  double wall_share = 0.35;
  double leaf_area_density = 0.6;

  static constexpr auto schema() {
    using P = CampusParams;
    return std::tuple{
        optional("layout", &P::layout, "",
                 "streets: houses, trees and cars everywhere, overpasses over the streets; rows: "
                 "equal houses every 12 m along the streets along y, others only at the ends of "
                 "these streets; tunnel: a smooth one over the second street of route 0; square: "
                 "an empty flat one in the middle. The last three have no overpasses"),
        optional("tunnel_length", &P::tunnel_length, "m",
                 "of the layout tunnel; the street is 30 m longer at least", between(10, 1000)),
        optional("square_radius", &P::square_radius, "m", "of the layout square",
                 between(10, 1000)),
        optional("size_x", &P::size_x, "m", "extent along x", between(60, 5000)),
        optional("size_y", &P::size_y, "m", "extent along y", between(60, 5000)),
        optional("origin_x", &P::origin_x, "m", "map coordinates of the centre of the campus",
                 between(-1e7, 1e7)),
        optional("origin_y", &P::origin_y, "m", "map coordinates of the centre of the campus",
                 between(-1e7, 1e7)),
        optional("origin_z", &P::origin_z, "m",
                 "map coordinates of the middle between the highest and the lowest ground",
                 between(-1e4, 1e4)),
        optional("ground_relief", &P::ground_relief, "m",
                 "difference between the highest and the lowest ground", between(0, 20)),
        optional("ground_cell", &P::ground_cell, "m", "edge of the ground's triangles",
                 between(0.25, 10)),
        optional("street_spacing", &P::street_spacing, "m",
                 "distance of the streets; at least two run each way", between(30, 500)),
        optional("street_width", &P::street_width, "m", "kept free of everything", between(5, 12)),
        optional("street_jitter", &P::street_jitter, "m",
                 "how far a crossing may be off the regular grid", between(0, 20)),
        optional("overpass_clearance", &P::overpass_clearance, "m",
                 "height between the street and the overpass", between(4, 8)),
        optional("building_density", &P::building_density, "",
                 "share of the blocks that is built on, where it fits", between(0, 0.6)),
        optional("trees_per_hectare", &P::trees_per_hectare, "1/ha", "inside the blocks",
                 between(0, 1000)),
        optional("parked_cars", &P::parked_cars, "",
                 "share of the parking places beside streets that have a car", between(0, 1)),
        optional("wall_share", &P::wall_share, "", "share of the blocks' edges with a wall",
                 between(0, 1)),
        optional("leaf_area_density", &P::leaf_area_density, "m2/m3",
                 "one-sided leaf area in a crown; decides how far a ray gets", between(0, 5)),
    };
  }
};

/// [map]: the wide-area map.
struct MapParams {
  double point_spacing = 0.14;
  double noise = 0.02;
  int holes = 0;
  double hole_radius = 40.0;
  int moving_vehicles = 0;
  int points_per_file = 0;

  static constexpr auto schema() {
    using P = MapParams;
    return std::tuple{
        optional("point_spacing", &P::point_spacing, "m",
                 "one point per point_spacing^2 of surface", between(0.02, 5)),
        optional("noise", &P::noise, "m",
                 "standard deviation along the surface's normal, cut off at three of them",
                 between(0, 0.5)),
        optional("holes", &P::holes, "",
                 "discs on the driven path in which the map has no points at any height, evenly "
                 "spread over the drive; none where it starts or a kidnap ends",
                 between(0, 1000)),
        optional("hole_radius", &P::hole_radius, "m", "of each hole", between(1, 1000)),
        optional("moving_vehicles", &P::moving_vehicles, "",
                 "vehicles that drove past while the map was made: the map has the points of their "
                 "trails, the scans do not",
                 between(0, 1000)),
        optional("points_per_file", &P::points_per_file, "",
                 "if not 0, the map is written as map/000000.pcd, ... of at most this many points, "
                 "and never held as a whole: for maps larger than memory",
                 between(0, 100'000'000)),
    };
  }
};

/// [changes]: how the campus differs on the day of the drive from the day of the map.
struct ChangesParams {
  double moved_cars = 0.0;
  int buildings_gone = 0, buildings_new = 0;
  double leaves_gone = 0.0;
  int fences_new = 0;
  bool rebuilt_half = false;

  static constexpr auto schema() {
    using P = ChangesParams;
    return std::tuple{
        optional("moved_cars", &P::moved_cars, "",
                 "share of the parked cars that left; as many arrived at other parking places, if "
                 "there are enough",
                 between(0, 1)),
        optional("buildings_gone", &P::buildings_gone, "", "buildings that were taken away",
                 between(0, 1000)),
        optional("buildings_new", &P::buildings_new, "",
                 "buildings that were built between the others; trees made way for them",
                 between(0, 1000)),
        optional("leaves_gone", &P::leaves_gone, "", "share of the leaves that fell",
                 between(0, 1)),
        optional("fences_new", &P::fences_new, "",
                 "straight walls that were built beside the streets", between(0, 1000)),
        optional("rebuilt_half", &P::rebuilt_half, "",
                 "true: where x > origin_x, all buildings were taken away, and as many were built "
                 "elsewhere in that half, if there are places"),
    };
  }
  [[nodiscard]] bool any() const noexcept {
    return moved_cars > 0.0 || buildings_gone > 0 || buildings_new > 0 || leaves_gone > 0.0 ||
           fences_new > 0 || rebuilt_half;
  }
};

/// [drive]: where the sensor goes.
struct DriveParams {
  int route = 0;
  double speed = 1.5;
  std::optional<double> length;
  int scan_every = 1;
  double lateral_offset = -1.2;
  double turn_radius = 4.0;
  double start_time = 0.0;
  int kidnaps = 0;
  double acceleration = 1.0;
  double still_start = 0.0;
  int stops = 0;
  double stop_time = 3.0;
  int turns_in_place = 0;
  double turn_rate = 90.0;
  double roughness = 0.0, roughness_length = 2.0;

  static constexpr auto schema() {
    using P = DriveParams;
    return std::tuple{
        optional("route", &P::route, "",
                 "0: loop around the inner blocks; 1: up and down the streets; 2: figure of "
                 "eight (at least 3 streets each way)",
                 between(0, 2)),
        optional("speed", &P::speed, "m/s", "constant but for starts, stops and turns on the spot",
                 between(0.1, 30)),
        optional("length", &P::length, "m", "length of the drive; one lap if left out",
                 between(1, 1e6)),
        optional("scan_every", &P::scan_every, "", "keep every n-th revolution", between(1, 10000)),
        optional("lateral_offset", &P::lateral_offset, "m",
                 "from the middle of the street, positive to the left", between(-5, 5)),
        optional("turn_radius", &P::turn_radius, "m", "smallest, of a right-angled turn",
                 between(2, 12)),
        optional("start_time", &P::start_time, "s", "stamp of the first scan", between(0, 4e9)),
        optional("kidnaps", &P::kidnaps, "",
                 "how often the sensor is carried to another place far away on the route, with "
                 "another heading and unnoticed by odometry; evenly spread over the drive",
                 between(0, 1000)),
        optional("acceleration", &P::acceleration, "m/s2", "of starts and stops",
                 between(0.05, 20)),
        optional("still_start", &P::still_start, "s",
                 "the sensor stands still for so long from the first scan on; 0: it drives at full "
                 "speed from the first scan on",
                 between(0, 600)),
        optional("stops", &P::stops, "", "how often the sensor stops, evenly spread over the drive",
                 between(0, 1000)),
        optional("stop_time", &P::stop_time, "s", "it stands still at each stop", between(0, 600)),
        optional("turns_in_place", &P::turns_in_place, "",
                 "how often the sensor halts, turns on the spot by 90 degrees and back, to the "
                 "left and to the right by turns; evenly spread over the drive",
                 between(0, 1000)),
        optional("turn_rate", &P::turn_rate, "deg/s",
                 "of turns on the spot, which take 0.25 s to reach it", between(5, 360)),
        optional("roughness", &P::roughness, "m",
                 "largest height of a wheel above or below the smooth ground; the sensor heaves, "
                 "pitches and rolls",
                 between(0, 0.2)),
        optional("roughness_length", &P::roughness_length, "m",
                 "shorter wave length of the rough ground along the way; the longer one is 1.618 "
                 "times that",
                 between(1, 50)),
    };
  }
};

/// [odometry]: how often the noisy odometry reports, and how it drifts.
struct OdometryParams {
  std::optional<double> rate;
  double translation_noise = 0.01;
  double rotation_noise = 0.1;
  double slip = 0.0, slip_factor = 1.3;

  static constexpr auto schema() {
    using P = OdometryParams;
    return std::tuple{
        optional("rate", &P::rate, "Hz",
                 "a pose at every 1/rate s from the stamp of the first scan to the end of the last "
                 "sweep; if left out, a pose at the stamp of each scan",
                 between(0.1, 1000)),
        optional("translation_noise", &P::translation_noise, "m/sqrt(m)",
                 "random walk of each coordinate over the distance driven", between(0, 1)),
        optional("rotation_noise", &P::rotation_noise, "deg/sqrt(m)",
                 "random walk of each angle over the distance driven", between(0, 10)),
        optional("slip", &P::slip, "",
                 "share of the way on which the wheels slip: one piece of every 10 m, at a random "
                 "place in them",
                 between(0, 1)),
        optional("slip_factor", &P::slip_factor, "",
                 "odometry's way over the true way while the wheels slip: above 1 they spin, below "
                 "1 they slide",
                 between(0, 5)),
    };
  }
};

/// The unit in which a driver reports accelerations.
enum class AccelerationUnit : std::uint8_t { metres_per_second_squared, g };
constexpr auto enum_names(AccelerationUnit) {
  return std::array{
      std::pair{std::string_view("m/s2"), AccelerationUnit::metres_per_second_squared},
      std::pair{std::string_view("g"), AccelerationUnit::g}};
}

/// [imu]: the inertial measurement unit; its noise is that of a Livox MID-360 by default.
struct ImuParams {
  std::optional<double> rate;
  double gyro_noise = 7.9e-5, accel_noise = 9.8e-4;
  std::vector<double> gyro_bias{0.0, 0.0, 0.0}, accel_bias{0.0, 0.0, 0.0};
  AccelerationUnit unit = AccelerationUnit::metres_per_second_squared;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double roll = 0.0, pitch = 0.0, yaw = 0.0;
  double clock_offset = 0.0;

  static constexpr auto schema() {
    using P = ImuParams;
    return std::tuple{
        optional("rate", &P::rate, "Hz", "samples a second; no imu.csv if left out",
                 between(1, 2000)),
        optional("gyro_noise", &P::gyro_noise, "rad/s/sqrt(Hz)",
                 "density of the white noise of each rate", between(0, 0.1)),
        optional("accel_noise", &P::accel_noise, "m/s2/sqrt(Hz)",
                 "density of the white noise of each acceleration", between(0, 1)),
        optional("gyro_bias", &P::gyro_bias, "deg/s",
                 "constant error of the rates, x, y and z; or one number: its norm, with a "
                 "direction that is drawn from the seed",
                 between(-100, 100)),
        optional("accel_bias", &P::accel_bias, "m/s2",
                 "constant error of the accelerations, x, y and z; or one number: its norm, with a "
                 "direction that is drawn from the seed",
                 between(-10, 10)),
        optional("unit", &P::unit, "", "of the accelerations in imu.csv"),
        optional("position", &P::position, "m", "[x, y, z] of the IMU in the sensor's frame",
                 between(-10, 10)),
        optional("roll", &P::roll, "deg",
                 "orientation of the IMU in the sensor's frame: Rz(yaw) Ry(pitch) Rx(roll)",
                 between(-180, 180)),
        optional("pitch", &P::pitch, "deg", "see roll", between(-180, 180)),
        optional("yaw", &P::yaw, "deg", "see roll", between(-180, 180)),
        optional("clock_offset", &P::clock_offset, "s", "added to the stamps in imu.csv",
                 between(-10, 10)),
    };
  }
  [[nodiscard]] Result<void> validate() const;
};

/// A world file.
struct WorldParams {
  int schema_version = 1;
  std::uint64_t seed = 1;
  CampusParams campus;
  ChangesParams changes;
  MapParams map;
  LidarParams lidar;
  DriveParams drive;
  OdometryParams odometry;
  ImuParams imu;

  static constexpr auto schema() {
    using P = WorldParams;
    return std::tuple{
        required("schema", &P::schema_version, "", "version of this file's format, 1",
                 between(1, 1)),
        optional("seed", &P::seed, "", "another seed makes another world of the same kind"),
        optional("campus", &P::campus, "", "what there is"),
        optional("changes", &P::changes, "", "what changed between the map and the drive"),
        optional("map", &P::map, "", "the wide-area map"),
        optional("lidar", &P::lidar, "", "the sensor"),
        optional("drive", &P::drive, "", "where the sensor goes"),
        optional("odometry", &P::odometry, "", "how the odometry drifts"),
        optional("imu", &P::imu, "", "the inertial measurement unit"),
    };
  }
  /// Checks that involve several tables: the streets fit the campus, the route fits the streets,
  /// kidnaps and holes fit the drive, and the numbers of points, scans and samples are not too
  /// large.
  [[nodiscard]] Result<void> validate() const;
};

/// A world of this table, in which the keys of [lidar] that are left out have the values of
/// `lidar.model`. Errors: those of parse, with the line of the wrong key.
[[nodiscard]] Result<WorldParams> parse_world(const Table& table);
/// Errors: those of load_toml and of parse_world.
[[nodiscard]] Result<WorldParams> load_world(const std::filesystem::path& file,
                                             const std::vector<std::string>& overrides = {});

/// All values, defaults included, as a world file.
[[nodiscard]] std::string to_world_file(const WorldParams& params);

}  // namespace vantage::simulation
