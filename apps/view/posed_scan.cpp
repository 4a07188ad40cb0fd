#include "view/posed_scan.hpp"

#include <utility>

#include "vantage/engine/prepared_scan.hpp"
#include "vantage/track/rotation.hpp"

namespace vantage::view {
namespace {

/// None if the ends of the sweep have no poses.
std::optional<SweepMotion> motion_during(const SweepTime& sweep, const io::Trajectory& reference) {
  if (!(sweep.last > sweep.first)) return std::nullopt;
  const auto first = pose_at(reference, sweep.first), last = pose_at(reference, sweep.last);
  if (!first || !last) return std::nullopt;
  const Twist twist = logarithm(first->inverse() * *last);
  const double per_second = 1.0 / (sweep.last - sweep.first);
  const MotionState state{.velocity = per_second * twist.linear,
                          .rate_bias = -per_second * twist.angular};
  return SweepMotion(state, MotionInputs(MotionMounts{}), sweep, sweep.last);
}

}  // namespace

Result<std::optional<PosedScan>> posed_scan(const io::StampedScan& scan,
                                            const io::Trajectory& reference) {
  const Scan recorded{.stamp = scan.stamp, .points = scan.points, .seconds = scan.seconds};
  VANTAGE_TRY(const SweepTime sweep, time_of(recorded));
  const auto pose = pose_at(reference, sweep.middle());
  if (!pose) return std::nullopt;
  const auto motion = motion_during(sweep, reference);
  VANTAGE_TRY(PreparedScan prepared,
              prepare_scan(recorded, motion ? &*motion : nullptr, LocalizerParams{}));
  return PosedScan{std::move(prepared.points), *pose};
}

}  // namespace vantage::view
