#pragma once

#include "vantage/evaluation/run.hpp"
#include "vantage/io/imu_io.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// How the clock of an IMU differs from that of the scans.
struct ClockOffset {
  double seconds = 0.0;      ///< to be added to the stamps of the IMU
  double correlation = 0.0;  ///< of the rates of turn, with the offset
};

/// Finds the offset at which the IMU turns as the poses do. Only the sizes of the rates of turn are
/// compared, so the IMU may be mounted in any way. Every offset is tried at which most of the poses
/// lie within the IMU's samples. Samples cover no time between two that are more than 0.5 s apart,
/// so stray stamps do not matter.
/// @param poses  of the sensor, in the clock of the scans
/// Errors: `invalid_input` if the sensor turns too little, or if nothing in the IMU's samples
/// resembles its turns.
[[nodiscard]] Result<ClockOffset> clock_offset_of(const io::Trajectory& poses,
                                                  const io::ImuRecording& imu);

/// Does so with the first minute of a recording, localized without the IMU.
/// Errors: those above, and of localize_each.
[[nodiscard]] Result<ClockOffset> measure_clock_offset(Localizer localizer,
                                                       const RunInputs& inputs);

}  // namespace vantage
