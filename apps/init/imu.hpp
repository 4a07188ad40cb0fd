#pragma once

#include <optional>
#include <string>
#include <vector>

#include "checks/scan_facts.hpp"
#include "terminal/input_options.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::init {

/// An IMU that suits the scans.
struct UsableImu {
  std::string option;       ///< of --imu: a path, or a topic of the scans' bag
  std::string topic;        ///< of --imu-topic; empty if none is needed
  Pose T_sensor_imu;        ///< in the LiDAR's frame
  std::string why;          ///< where its mount comes from, a sentence
  std::string description;  ///< "/imu/data, 200 Hz, accelerations in m/s^2"
};

/// The IMU of a run, and what there is to say of those that are not used.
struct ImuChoice {
  std::optional<UsableImu> imu;
  std::vector<std::string> remarks;
};

/// Chooses the IMU: that of --imu, or else the only one in the scans' bag, which is then put into
/// `inputs`. One that was recorded at another time, or whose axes are not those of the scans and
/// whose mount is unknown, is not used: a remark says so, and `inputs` has none.
/// @param first  stamp of the first scan [s]
/// Errors: those of a bag; those of read_imu and sensor_mount with --imu.
[[nodiscard]] Result<ImuChoice> choose_imu(const InputOptions& options, RunInputs& inputs,
                                           const checks::ScanFacts& scans, double first);

/// Whether gravity in the LiDAR's frame points to the ground that its scans show: to within 20
/// degrees, or the scans show none.
/// @param down  unit vector, LiDAR's frame
[[nodiscard]] bool agrees_with_ground(const Eigen::Vector3d& down, const checks::ScanFacts& scans);

}  // namespace vantage::init
