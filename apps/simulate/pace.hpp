#pragma once

#include <vector>

#include "simulate/params.hpp"

namespace vantage::simulation {

/// How a drive goes over time: the way, with its starts and halts, and the turns on the spot.
///
/// Stop i of n is at (i + 1) / (n + 1) of the length, turn i of n at (i + 1/2) / n. Speed is
/// continuous, and so is the rate of a turn, which takes a quarter of a second to reach its value.
/// A drive without `still_start` begins at full speed. After its length, it goes on.
class Pace {
 public:
  /// @param length  of the drive [m]
  Pace(const DriveParams& params, double length);

  /// Whether the drive stands still at its start, and thus before it.
  [[nodiscard]] bool starts_still() const noexcept { return phases_.front().speed == 0.0; }
  /// How long it takes to drive the length [s].
  [[nodiscard]] double seconds() const noexcept { return seconds_; }
  /// The way after this time; a negative time is before the start [s, m].
  [[nodiscard]] double distance(double seconds) const noexcept;
  /// The turn on the spot after this time, to the left [s, rad].
  [[nodiscard]] double turned(double seconds) const noexcept;

  /// The way on which a drive can stop from full speed [m].
  [[nodiscard]] static double stopping_distance(const DriveParams& params) noexcept;
  /// Where the first halt is [m]; the length if there is none.
  [[nodiscard]] static double first_halt(const DriveParams& params, double length) noexcept;

 private:
  struct Phase {
    double begin;                          // [s]
    double distance, speed, acceleration;  // at its begin
    double turned = 0.0, turn = 0.0;       // at its begin, and in all [rad]
  };
  [[nodiscard]] const Phase& at(double seconds) const noexcept;
  /// Drives to a distance and halts there.
  void halt_at(double distance);
  void rest(double seconds);
  void turn(double from, double angle);
  void add(const Phase& phase, double seconds);

  double speed_, acceleration_, turn_rate_;
  std::vector<Phase> phases_;  // one after the other; the last one has no end
  double now_ = 0.0, distance_ = 0.0, speed_now_ = 0.0;  // at the end of the phases so far
  double seconds_ = 0.0;
};

}  // namespace vantage::simulation
