#include "io/made_scan.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "vantage/io/point_times.hpp"

namespace vantage::io {
namespace {

constexpr std::uint8_t kNoiseBits = 0x0F;

bool is_no_return(const Point& point) { return point.isZero(0.0); }

/// Leaves out points for which `is_left_out(index)` holds, with their times and tags.
/// @return  how many these are
template <class IsLeftOut>
std::uint64_t leave_out(LoadedCloud& cloud, const IsLeftOut& is_left_out) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (is_left_out(i)) continue;
    if (kept != i) {
      cloud.points[kept] = cloud.points[i];
      if (!cloud.times.values.empty()) cloud.times.values[kept] = cloud.times.values[i];
      if (!cloud.tags.empty()) cloud.tags[kept] = cloud.tags[i];
    }
    ++kept;
  }
  const std::uint64_t count = cloud.points.size() - kept;
  cloud.points.resize(kept);
  if (!cloud.times.values.empty()) cloud.times.values.resize(kept);
  if (!cloud.tags.empty()) cloud.tags.resize(kept);
  return count;
}

}  // namespace

Result<StampedScan> made_scan(LoadedCloud cloud, double stamp, const ScanOptions& options,
                              const std::string& file) {
  StampedScan scan;
  // First, because drivers leave the times of such points unset.
  scan.no_returns = leave_out(cloud, [&](std::size_t i) { return is_no_return(cloud.points[i]); });
  if (options.tags == Tags::normal && !cloud.tags.empty()) {
    scan.noise = leave_out(cloud, [&](std::size_t i) { return (cloud.tags[i] & kNoiseBits) != 0; });
  }
  VANTAGE_TRY(scan.seconds, seconds_after(stamp, cloud.times, file, options.stamped));
  scan.stamp = stamp;
  scan.points = std::move(cloud.points);
  scan.dropped = cloud.dropped;
  scan.name = file;
  return scan;
}

}  // namespace vantage::io
