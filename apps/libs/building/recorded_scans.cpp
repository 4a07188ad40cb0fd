#include "building/recorded_scans.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>

#include "vantage/engine/prepared_scan.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::building {
namespace {

/// As the points would have been seen at `stamp`. Points at whose time there is no pose are left
/// where they were measured. All points of a millisecond have the pose at its middle; `stamp` is
/// the middle of one.
void straighten(io::StampedScan& scan, const io::Trajectory& trajectory, double stamp,
                const Pose& T_map_sensor) {
  const Pose T_sensor_map = T_map_sensor.inverse();
  constexpr double kStep = 1e-3;  // [s]
  std::optional<Pose> T_now;
  double now = 0.0;  // [steps] after the stamp; the pose there changes nothing
  for (std::size_t i = 0; i < scan.seconds.size(); ++i) {
    const double after = scan.stamp + static_cast<double>(scan.seconds[i]) - stamp;
    if (const double step = std::round(after / kStep); step != now) {
      now = step;
      const auto there = pose_at(trajectory, stamp + now * kStep);
      T_now = now != 0.0 && there ? std::optional(T_sensor_map * *there) : std::nullopt;
    }
    if (T_now) scan.points[i] = *T_now * scan.points[i];
  }
}

}  // namespace

Result<std::vector<LocatedScan>> recorded_scans(const Config& config) {
  constexpr double kApart = 2.0;  // [m]
  std::vector<LocatedScan> located;
  if (!config.selector || !config.selector->scans) return located;
  const auto& poses = config.selector->poses ? config.selector->poses : config.map->trajectory;
  VANTAGE_TRY(const io::Trajectory trajectory, io::read_trajectory(*poses));
  io::ScanOptions options;
  options.path = *config.selector->scans;
  VANTAGE_TRY(const auto source, io::open_scans(options));
  double first = 0.0, last = 0.0;
  std::size_t scans = 0;
  std::optional<Point> before;
  while (true) {
    VANTAGE_TRY(auto scan, source->next());
    if (!scan) break;
    if (scans++ == 0) first = scan->stamp;
    last = scan->stamp;
    if (scan->points.empty()) continue;
    VANTAGE_TRY(const SweepTime sweep,
                time_of({.stamp = scan->stamp, .points = scan->points, .seconds = scan->seconds}));
    const double stamp = sweep.middle();
    const auto T_map_sensor = pose_at(trajectory, stamp);
    if (!T_map_sensor) continue;
    const Point& at = T_map_sensor->translation;
    if (before && (at - *before).norm() < kApart) continue;
    before = at;
    straighten(*scan, trajectory, stamp, *T_map_sensor);
    VANTAGE_TRY(PreparedScan prepared,
                prepare_scan({.points = scan->points}, nullptr, LocalizerParams{}));
    located.push_back({.points = std::move(prepared.points), .T_map_scan = *T_map_sensor});
    located.back().points.shrink_to_fit();
  }
  if (!located.empty()) return located;
  return fail(ErrorCode::invalid_input,
              fmt::format("none of the {} scans in {} has a pose: the scans are stamped {:.3f} to "
                          "{:.3f} s, the poses {:.3f} to {:.3f} s",
                          scans, config.selector->scans->string(), first, last,
                          trajectory.front().stamp, trajectory.back().stamp),
              SourceLocation{poses->string(), 0, 0});
}

}  // namespace vantage::building
