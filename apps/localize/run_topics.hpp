#pragma once

namespace vantage {

/// Names in the recording of a run (see RunRecorder).
namespace topics {
inline constexpr const char* kMap = "/map";
inline constexpr const char* kScan = "/scan";
inline constexpr const char* kPose = "/pose";
inline constexpr const char* kPoseWithCovariance = "/pose_with_covariance";
inline constexpr const char* kRegion = "/region";
inline constexpr const char* kTf = "/tf";
inline constexpr const char* kDiagnostics = "/diagnostics";
}  // namespace topics

inline constexpr const char* kMapFrame = "map";
inline constexpr const char* kScanFrame = "lidar";
/// The one status in its diagnostics.
inline constexpr const char* kStatusName = "vantage: localization";

}  // namespace vantage
