#include "simulate/events.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "simulate/random.hpp"
#include "vantage/engine/config.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;

constexpr double kFar = 0.3;            // of the mean extent of the campus
constexpr double kTurned = 0.7071;      // cosine of the smallest change of heading
constexpr double kMappedAround = 20.0;  // between a landing place and a hole [m]
constexpr int kAttempts = 200;

class Planner {
 public:
  Planner(const Route& route, const WorldParams& params, const Pace& pace)
      : route_(route), params_(params), pace_(pace), scans_(number_of_scans(params, pace)) {}

  [[nodiscard]] std::optional<Events> plan(std::uint64_t attempt, bool leave_holes) {
    Events events;
    auto kidnaps = draw_kidnaps(Random(hash(params_.seed, Purpose::kidnap, attempt)));
    if (!kidnaps) return std::nullopt;
    events.kidnaps = *std::move(kidnaps);
    drive(events.kidnaps);
    for (int k = 0; k < params_.map.holes; ++k) {
      const auto hole = find_hole(k, events.holes, leave_holes);
      if (!hole) return std::nullopt;
      events.holes.push_back(*hole);
    }
    return events;
  }

 private:
  [[nodiscard]] double driven(std::size_t scan) const {
    return pace_.distance(static_cast<double>(scan) * seconds_per_scan(params_));
  }

  [[nodiscard]] std::optional<std::vector<Kidnap>> draw_kidnaps(Random random) const {
    const double far = kFar * (params_.campus.size_x + params_.campus.size_y) / 2.0;
    std::vector<Kidnap> kidnaps;
    double ahead = 0.0;
    const auto parts = static_cast<std::size_t>(params_.drive.kidnaps) + 1;
    for (std::size_t k = 1; k < parts; ++k) {
      const std::size_t scan = k * scans_ / parts;
      const double before = driven(scan) + ahead;
      const auto lands_well = [&](double there) {
        return (route_.position(there) - route_.position(before)).norm() >= far &&
               route_.direction(there).dot(route_.direction(before)) <= kTurned;
      };
      double there = 0.0;
      int draws = 0;
      do {
        if (++draws > kAttempts) return std::nullopt;
        there = route_.length() * random.uniform();
      } while (!lands_well(there));
      ahead = there - driven(scan) + route_.length() * std::ceil(driven(scan) / route_.length());
      kidnaps.push_back({scan, ahead});
    }
    return kidnaps;
  }

  /// Records where the scans are.
  void drive(const std::vector<Kidnap>& kidnaps) {
    positions_.clear();
    starts_ = {0};
    for (const Kidnap& kidnap : kidnaps) starts_.push_back(kidnap.scan);
    auto next = kidnaps.begin();
    double ahead = 0.0;
    for (std::size_t scan = 0; scan < scans_; ++scan) {
      if (next != kidnaps.end() && next->scan == scan) ahead = (next++)->ahead;
      positions_.push_back(route_.position(driven(scan) + ahead));
    }
  }

  [[nodiscard]] std::optional<Hole> find_hole(int number, const std::vector<Hole>& others,
                                              bool leave_hole) const {
    const auto parts = static_cast<std::size_t>(params_.map.holes);
    const std::size_t first = static_cast<std::size_t>(number) * scans_ / parts;
    const std::size_t end = (static_cast<std::size_t>(number) + 1) * scans_ / parts;
    const std::size_t middle = (first + end) / 2;
    for (std::size_t step = 0; step <= end - first; ++step) {
      // Middle, one after it, one before it, two after it, ...
      const std::size_t off = (step + 1) / 2;
      if (step % 2 == 0 && off > middle - first) continue;
      const std::size_t scan = step % 2 == 0 ? middle - off : middle + off;
      if (scan >= end) continue;
      const Hole hole{positions_[scan], params_.map.hole_radius};
      if (fits(hole, others) && (!leave_hole || is_left(hole, scan))) return hole;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool fits(const Hole& hole, const std::vector<Hole>& others) const {
    return std::all_of(starts_.begin(), starts_.end(),
                       [&](std::size_t start) {
                         return (positions_[start] - hole.centre).norm() >
                                hole.radius + kMappedAround;
                       }) &&
           std::all_of(others.begin(), others.end(), [&](const Hole& other) {
             return (other.centre - hole.centre).norm() >= other.radius + hole.radius;
           });
  }

  /// Whether the last scan before the next kidnap, or of the drive, is outside.
  [[nodiscard]] bool is_left(const Hole& hole, std::size_t scan) const {
    const auto next = std::upper_bound(starts_.begin(), starts_.end(), scan);
    return !hole.contains(positions_[(next == starts_.end() ? scans_ : *next) - 1]);
  }

  const Route& route_;
  const WorldParams& params_;
  const Pace& pace_;
  std::size_t scans_;
  std::vector<Vector2d> positions_;  // of the scans
  std::vector<std::size_t> starts_;  // scans that begin somewhere new
};

}  // namespace

double seconds_per_scan(const WorldParams& params) noexcept {
  return params.drive.scan_every / params.lidar.rate;
}

std::size_t number_of_scans(const WorldParams& params, const Pace& pace) noexcept {
  const double interval = seconds_per_scan(params);
  constexpr double kRounding = 1e-9;  // a drive of exactly 50 intervals has 50 scans
  return std::max(std::size_t{1},
                  static_cast<std::size_t>(std::ceil(pace.seconds() / interval - kRounding)));
}

Result<Events> plan_events(const Route& route, const WorldParams& params, const Pace& pace) {
  const auto kidnaps = static_cast<std::size_t>(params.drive.kidnaps);
  if (kidnaps == 0 && params.map.holes == 0) return Events{};
  const std::size_t scans = number_of_scans(params, pace);
  if (kidnaps > 0 && scans / (kidnaps + 1) < 2) {
    return fail_at({"drive.kidnaps", "drive.length", "drive.scan_every"},
                   "drive.kidnaps = " + std::to_string(kidnaps) + " leaves less than two scans " +
                       "between kidnaps: the drive has " + std::to_string(scans));
  }
  Planner planner(route, params, pace);
  const int attempts = kidnaps == 0 ? 1 : kAttempts;  // without kidnaps, nothing is random
  for (const bool leave_holes : {true, false}) {
    for (int k = 0; k < attempts; ++k) {
      if (auto events = planner.plan(static_cast<std::uint64_t>(k), leave_holes)) {
        return *std::move(events);
      }
    }
  }
  if (params.map.holes == 0) {
    return fail_at({"drive.kidnaps", "drive.route"},
                   "the route has no place that is far enough away for drive.kidnaps: enlarge the "
                   "campus");
  }
  return fail_at({"map.holes", "map.hole_radius", "drive.kidnaps", "drive.length"},
                 "map.holes = " + std::to_string(params.map.holes) +
                     " of map.hole_radius = " + to_toml(Value{params.map.hole_radius, {}}) +
                     " m do not fit the drive and its kidnaps: take fewer or smaller ones, or a "
                     "longer drive");
}

}  // namespace vantage::simulation
