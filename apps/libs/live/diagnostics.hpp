#pragma once

#include <string>

#include "io/ros/message_writers.hpp"
#include "vantage/engine/localizer.hpp"

namespace vantage {

/// How serious the state of a scan is, for the diagnostics of a robot.
[[nodiscard]] inline io::ros::Diagnostic::Level level_of(const ScanReport& report) {
  using Level = io::ros::Diagnostic::Level;
  switch (report.tracking) {
    case Tracking::tracked: return Level::ok;
    case Tracking::uncertain: return Level::warn;
    case Tracking::lost: break;
  }
  return Level::error;
}

/// The state and its reason: "lost: NVTL 0.45 below min_nvtl".
[[nodiscard]] inline std::string message_of(const ScanReport& report) {
  const std::string state = to_string(report.tracking);
  return report.reason.empty() ? state : state + ": " + report.reason;
}

}  // namespace vantage
