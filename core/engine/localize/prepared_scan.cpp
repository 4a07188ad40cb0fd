#include "vantage/engine/prepared_scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "vantage/kit/voxel_points.hpp"

namespace vantage {
namespace {

constexpr double kMaxRange = 10e3;  // [m]; no LiDAR sees so far

/// Whether a LiDAR may have measured a point; not if one of the numbers is none.
bool is_possible(double range, double stamp) { return range <= kMaxRange && std::isfinite(stamp); }

}  // namespace

Result<SweepTime> time_of(const Scan& scan) {
  constexpr double kLongest = 10.0;  // [s]
  if (!scan.seconds.empty() && scan.seconds.size() != scan.points.size()) {
    return fail(ErrorCode::invalid_input, "the scan has " + std::to_string(scan.points.size()) +
                                              " points and " + std::to_string(scan.seconds.size()) +
                                              " times, expected one for each");
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  SweepTime time{kInfinity, -kInfinity};
  for (std::size_t i = 0; i < scan.seconds.size(); ++i) {
    const double stamp = scan.stamp + static_cast<double>(scan.seconds[i]);
    if (!is_possible(scan.points[i].norm(), stamp)) continue;
    time.first = std::min(time.first, stamp);
    time.last = std::max(time.last, stamp);
  }
  if (time.first > time.last) return SweepTime{scan.stamp, scan.stamp};
  if (time.last - time.first > kLongest) {
    return fail(ErrorCode::invalid_input, "the points of the scan were measured during " +
                                              std::to_string(time.last - time.first) +
                                              " s, expected the time of a sweep");
  }
  if (std::max(std::abs(time.first - scan.stamp), std::abs(time.last - scan.stamp)) > kLongest) {
    return fail(ErrorCode::invalid_input,
                "the points of the scan were measured " + std::to_string(time.first - scan.stamp) +
                    " s after its stamp, expected times of the same sweep");
  }
  return time;
}

Result<PreparedScan> prepare_scan(const Scan& scan, const SweepMotion* motion,
                                  const LocalizerParams& params) {
  const bool timed = !scan.seconds.empty();
  const double max_range = params.scan_max_range.value_or(kMaxRange);
  PreparedScan prepared;
  std::vector<double>& times = prepared.finite_times;
  prepared.finite.reserve(scan.points.size());
  if (timed) times.reserve(scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Point& p = scan.points[i];
    const double range = p.norm();
    const double stamp = timed ? scan.stamp + static_cast<double>(scan.seconds[i]) : scan.stamp;
    if (!is_possible(range, stamp)) {
      ++prepared.dropped;
      continue;
    }
    if (range < params.scan_min_range || range > max_range) continue;
    prepared.finite.push_back(motion ? motion->seen_from_middle(p, stamp) : p);
    if (timed) times.push_back(stamp);
  }
  if (params.scan_voxel_size > 0.0) {
    VANTAGE_TRY(TimedPoints thinned,
                voxel_centroids(prepared.finite, times, params.scan_voxel_size));
    prepared.points = std::move(thinned.points);
    prepared.times = std::move(thinned.times);
  } else {
    prepared.points = prepared.finite;
    prepared.times = times;
  }
  return prepared;
}

}  // namespace vantage
