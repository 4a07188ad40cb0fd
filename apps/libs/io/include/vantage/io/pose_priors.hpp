#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "vantage/io/sensor_trajectory.hpp"
#include "vantage/result.hpp"
#include "vantage/track/pose_prior.hpp"

namespace vantage::io {

/// Standard deviations of a prior; infinite where nothing is known. The defaults are those of plain
/// GNSS on a robot among buildings, whose errors last for minutes.
struct PriorSigmas {
  double horizontal = 5.0;               ///< along x and along y [m]
  double vertical = 1.0;                 ///< [m]
  double heading = 0.17453292519943295;  ///< about z [rad]; 10 degrees
};

/// Where priors come from.
struct PriorSource {
  std::filesystem::path path;  ///< a text file, see read_trajectory, or a ROS bag
  /// In a bag with several topics; of sensor_msgs/NavSatFix, or see ros::read_bag_trajectory.
  std::string topic = {};
  double rate_hz = 10.0;                     ///< of KITTI rows
  std::optional<PriorSigmas> sigmas = {};    ///< instead of what the messages say
  std::filesystem::path map_projector = {};  ///< map_projector_info.yaml; if empty, it is searched
                                             ///< beside `map_files`
  std::vector<std::filesystem::path> map_files = {};  ///< the map, as io::map_files takes it
};

struct StampedPrior {
  double stamp = 0.0;  ///< [s]
  PosePrior prior;     ///< of T_map_sensor
};

/// What a source says about where the sensor was.
struct PosePriors {
  std::vector<StampedPrior> priors;  ///< at least one; stamps increase strictly
  std::string source;                ///< the path and the topic, for messages
  /// Sentences for the user: what was left out, and why something is not known.
  std::vector<std::string> notes = {};
  /// At which a bag that is cut off or damaged ends; the priors are those before.
  std::optional<Error> damage = {};
};

/// Reads priors of the sensor.
///
/// Text files, nav_msgs/Odometry, geometry_msgs/PoseStamped, PoseWithCovarianceStamped,
/// TransformStamped and transforms: as read_sensor_trajectory reads them. If the sensor is not
/// where the poses are, its horizontal distance times the heading's sigma is added to the sigmas of
/// x and y in quadrature.
///
/// sensor_msgs/NavSatFix: positions without a heading, projected as Autoware's
/// map_projector_info.yaml says. The sensor's distance from the antenna has an unknown direction:
/// its vertical part is added to z, its horizontal length to the sigmas of x and y in quadrature.
/// Messages without a fix, or without a finite latitude and longitude, are left out; those without
/// an altitude say nothing about z. `notes` says how many.
///
/// Sigmas are `source.sigmas`, else those of the messages. A variance that is not above 0 is
/// unknown and gives the default; one of 1e5 m^2 or more, or pi^2 rad^2 or more, gives an infinite
/// sigma. Variances are those along the axes of the map (of east and north, for NavSatFix).
///
/// Errors: those of read_sensor_trajectory; `invalid_input` for sigmas that are not above 0 or all
/// infinite, and for NavSatFix without a projection; `corrupt_data` for a malformed projection, and
/// if no message can be used.
[[nodiscard]] Result<PosePriors> read_priors(const PriorSource& source, const SensorFrame& sensor);

/// The prior at a stamp [s]: poses as by pose_at, sigmas of the measurement that is nearer in time.
/// GNSS often measures once a second, so the gap may be longer than that of other poses.
[[nodiscard]] std::optional<PosePrior> prior_at(const PosePriors& priors, double stamp,
                                                double max_gap_s = 2.5);

}  // namespace vantage::io
