#include "simulate/params.hpp"

#include <cmath>
#include <numbers>

#include "simulate/drive.hpp"
#include "simulate/events.hpp"
#include "simulate/layouts.hpp"
#include "simulate/pace.hpp"
#include "simulate/route.hpp"
#include "simulate/street_grid.hpp"
#include "vantage/engine/config.hpp"

namespace vantage::simulation {
namespace {

std::string number(double x) { return to_toml(Value{x, {}}); }

}  // namespace

Result<void> LidarParams::validate() const {
  if (!(min_range < max_range)) {
    return fail_at({"min_range", "max_range"}, "min_range (" + number(min_range) +
                                                   " m) must be below max_range (" +
                                                   number(max_range) + " m)");
  }
  if (upper_rings >= rings) {
    return fail_at({"upper_rings", "rings"}, "upper_rings must be below rings");
  }
  if (upper_rings > 0 &&
      !(upper_spacing > 0.0 && highest_ring - upper_rings * upper_spacing > lowest_ring)) {
    return fail_at({"upper_spacing", "upper_rings"},
                   "upper_spacing must be above 0 deg and leave room for the other rings above "
                   "lowest_ring");
  }
  if (sweeps > 0.0) {
    if (upper_rings > 0) {
      return fail_at({"upper_rings", "sweeps"}, "upper_rings and sweeps exclude each other");
    }
    if (!((rings - 1) * ring_spacing < highest_ring - lowest_ring)) {
      return fail_at({"ring_spacing", "rings", "lowest_ring", "highest_ring"},
                     "rings that go up and down need more room than they span: (rings - 1) "
                     "ring_spacing must be below highest_ring - lowest_ring");
    }
  } else if (rings > 1 ? !(lowest_ring < highest_ring) : lowest_ring != highest_ring) {
    return fail_at({"lowest_ring", "highest_ring", "rings"},
                   rings > 1 ? "lowest_ring must be below highest_ring"
                             : "with one ring, lowest_ring and highest_ring must be equal");
  }
  if (covered_from.has_value() != covered_to.has_value()) {
    return fail_at({covered_from ? "covered_from" : "covered_to"},
                   "covered_from and covered_to belong together");
  }
  if (!(disturbed_from < disturbed_to)) {
    return fail_at({"disturbed_from", "disturbed_to"}, "disturbed_from must be below disturbed_to");
  }
  return {};
}

int LidarParams::firings() const noexcept {
  return static_cast<int>(std::lround(360.0 * turns / azimuth_step));
}

LidarParams lidar_of(SensorModel model) {
  LidarParams lidar;
  lidar.model = model;
  if (model == SensorModel::hdl64) {
    lidar.rings = 64;
    lidar.lowest_ring = -24.8;
    lidar.highest_ring = 2.0;
    lidar.upper_rings = 32;  // two blocks of lasers: 1/3 deg apart above, 1/2 deg below
    lidar.upper_spacing = 1.0 / 3.0;
    lidar.azimuth_step = 0.1728;
    lidar.min_range = 0.9;
    lidar.max_range = 120.0;
    lidar.range_noise = 0.02;
  } else if (model == SensorModel::mid360) {
    constexpr double kFirings = 5000.0;  // a sweep: 200,000 points a second, 4 at once
    lidar.rings = 4;
    lidar.lowest_ring = -7.2;
    lidar.highest_ring = 52.2;
    // About 180 turns and 10 ups and downs a second; the irrational parts make it never repeat.
    lidar.turns = 17.0 + std::numbers::phi - 0.5;
    lidar.sweeps = std::numbers::sqrt2 - 0.4;
    lidar.ring_spacing = 2.7;
    lidar.azimuth_step = 360.0 * lidar.turns / kFirings;
    lidar.min_range = 0.1;
    lidar.max_range = 70.0;
    lidar.sure_range = 40.0;
    lidar.range_noise = 0.02;
    lidar.angle_noise = 0.15;
  }
  return lidar;
}

Result<void> ImuParams::validate() const {
  const auto check = [](const char* key, const std::vector<double>& bias) -> Result<void> {
    if (bias.size() == 1 || bias.size() == 3) return {};
    return fail_at({key}, std::string(key) + " must have three numbers, or one that is its norm; " +
                              std::to_string(bias.size()) + " are given");
  };
  VANTAGE_CHECK(check("gyro_bias", gyro_bias));
  return check("accel_bias", accel_bias);
}

Result<void> WorldParams::validate() const {
  const StreetGrid streets(campus, seed);
  const double spacing = std::min(streets.spacing().x(), streets.spacing().y());
  if (campus.street_width > spacing / 4.0) {
    return fail_at({"campus.street_width", "campus.street_spacing"},
                   "campus.street_width (" + number(campus.street_width) +
                       " m) must be at most a quarter of the distance of the streets (" +
                       number(spacing) + " m)");
  }
  if (campus.street_jitter > spacing / 10.0) {
    return fail_at({"campus.street_jitter", "campus.street_spacing"},
                   "campus.street_jitter (" + number(campus.street_jitter) +
                       " m) must be at most a tenth of the distance of the streets (" +
                       number(spacing) + " m)");
  }
  const double half_width = campus.street_width / 2.0;
  if (std::abs(drive.lateral_offset) > half_width - 1.5) {
    return fail_at({"drive.lateral_offset", "campus.street_width"},
                   "drive.lateral_offset (" + number(drive.lateral_offset) +
                       " m) must leave 1.5 m to the edge of the street, which is " +
                       number(half_width) + " m from its middle");
  }
  // Smoothing cuts a right-angled corner by 0.6 turn_radius (see Route); the path must stay on the
  // street.
  const double largest_radius =
      std::numbers::sqrt2 * (half_width - std::abs(drive.lateral_offset)) / 0.6;
  if (drive.turn_radius > largest_radius) {
    return fail_at({"drive.turn_radius", "drive.lateral_offset", "campus.street_width"},
                   "drive.turn_radius (" + number(drive.turn_radius) +
                       " m) leaves the street in a turn: at most " + number(largest_radius) +
                       " m with this street_width and lateral_offset");
  }
  if (campus.layout == Layout::tunnel) {
    const Street street = tunnel_street(streets);
    const double longest = (street.to - street.from).norm() - 2.0 * kTunnelMouth;
    if (campus.tunnel_length > longest) {
      return fail_at({"campus.tunnel_length", "campus.layout", "campus.street_spacing"},
                     "campus.tunnel_length (" + number(campus.tunnel_length) +
                         " m) does not fit its street: at most " + number(longest) + " m");
    }
  }
  VANTAGE_TRY(const auto route, streets.route(drive.route));

  double length = 0.0;
  for (std::size_t i = 0; i < route.size(); ++i) {
    length += (route[(i + 1) % route.size()] - route[i]).norm();
  }
  length = drive.length.value_or(length);
  const double stopping = Pace::stopping_distance(drive);
  const double first_halt = Pace::first_halt(drive, length);
  if (drive.still_start == 0.0 && first_halt < stopping) {
    const auto metres = [](double x) { return number(std::round(x * 10.0) / 10.0) + " m"; };
    return fail_at({"drive.acceleration", "drive.stops", "drive.turns_in_place", "drive.speed"},
                   "the drive begins at full speed and needs " + metres(stopping) +
                       " to stop, but its first halt is " + metres(first_halt) +
                       " ahead: raise drive.acceleration or set drive.still_start");
  }
  const double seconds = Pace(drive, length).seconds();
  if (seconds * lidar.rate / drive.scan_every > 999'999.0) {
    return fail_at({"drive.scan_every", "drive.length", "drive.speed", "lidar.rate"},
                   "the drive would make more than a million scans: raise drive.scan_every");
  }
  constexpr double kMostSamples = 1e7;
  if (imu.rate && seconds * *imu.rate > kMostSamples) {
    return fail_at({"imu.rate", "drive.length", "drive.speed"},
                   "imu.rate would make more than 10 million samples: lower it");
  }
  if (odometry.rate && seconds * *odometry.rate > kMostSamples) {
    return fail_at({"odometry.rate", "drive.length", "drive.speed"},
                   "odometry.rate would make more than 10 million poses: lower it");
  }
  if (drive.kidnaps > 0 || map.holes > 0) {
    const Route path(route, drive.lateral_offset, drive.turn_radius);
    VANTAGE_CHECK(plan_events(path, *this, Pace(drive, drive.length.value_or(path.length()))));
  }
  // There is about half as much surface again as ground; indices of map points have 32 bits.
  const double points =
      1.5 * campus.size_x * campus.size_y / (map.point_spacing * map.point_spacing);
  if (points > 1e9) {
    return fail_at({"map.point_spacing", "campus.size_x", "campus.size_y"},
                   "the map would have about " + number(std::round(points / 1e8) / 10.0) +
                       "e9 points, more than the 1e9 that are allowed: raise map.point_spacing");
  }
  return {};
}

Result<WorldParams> parse_world(const Table& table) {
  Table world = table;
  for (Entry& entry : world.entries) {
    auto* lidar = std::get_if<Table>(&entry.value.data);
    if (entry.key != "lidar" || lidar == nullptr) continue;
    const Value* name = lidar->find("model");
    const auto* text = name == nullptr ? nullptr : std::get_if<std::string>(&name->data);
    if (text == nullptr) continue;
    for (const auto& [known, model] : enum_names(SensorModel{})) {
      if (known != *text) continue;
      for (const Entry& value : to_table(lidar_of(model)).entries) {
        if (lidar->find(value.key) == nullptr) lidar->entries.push_back(value);
      }
    }
  }
  return parse<WorldParams>(world);
}

Result<WorldParams> load_world(const std::filesystem::path& file,
                               const std::vector<std::string>& overrides) {
  VANTAGE_TRY(const Table table, load_toml(file, overrides));
  return parse_world(table);
}

std::string to_world_file(const WorldParams& params) { return to_toml(to_table(params)); }

}  // namespace vantage::simulation
