#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "dds/participant.hpp"
#include "vantage/io/pose_priors.hpp"
#include "vantage/params.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::dds {
constexpr auto enum_names(Release) {
  return std::array{std::pair{std::string_view("humble"), Release::humble},
                    std::pair{std::string_view("iron_or_later"), Release::iron_or_later}};
}
}  // namespace vantage::dds

namespace vantage::live {

/// Where a session begins without a pose that was kept.
enum class Start : std::uint8_t {
  anywhere,  ///< the sensor is looked for in all regions
  wait       ///< nothing is localized before a pose comes on `initial_pose`
};
constexpr auto enum_names(Start) {
  return std::array{std::pair{std::string_view("anywhere"), Start::anywhere},
                    std::pair{std::string_view("wait"), Start::wait}};
}

/// Which poses are published.
enum class Publish : std::uint8_t {
  tracked,    ///< those of tracked scans: their risk is at most [localizer] max_risk
  uncertain,  ///< also those of uncertain scans
};
constexpr auto enum_names(Publish) {
  return std::array{std::pair{std::string_view("tracked"), Publish::tracked},
                    std::pair{std::string_view("uncertain"), Publish::uncertain}};
}

/// The unit in which an IMU gives accelerations.
enum class ForceUnit : std::uint8_t { metres_per_second_squared, g };
constexpr auto enum_names(ForceUnit) {
  return std::array{std::pair{std::string_view("m/s^2"), ForceUnit::metres_per_second_squared},
                    std::pair{std::string_view("g"), ForceUnit::g}};
}

/// What connects map and robot in /tf.
enum class Transform : std::uint8_t {
  automatic,    ///< map -> odom if [live.topics] has odometry, else map -> base
  map_to_odom,  ///< needs odometry
  map_to_base,
  none
};
constexpr auto enum_names(Transform) {
  return std::array{std::pair{std::string_view("auto"), Transform::automatic},
                    std::pair{std::string_view("map_to_odom"), Transform::map_to_odom},
                    std::pair{std::string_view("map_to_base"), Transform::map_to_base},
                    std::pair{std::string_view("none"), Transform::none}};
}

/// [live.topics]: an empty name means that there is no such topic.
struct TopicParams {
  std::string points = "/points", imu, odometry, initial_pose = "/initialpose", prior, fix;
  std::string followed_pose;
  bool reliable_points = false;
  std::string pose = "/amcl_pose", pose_stamped, filtered_odometry, map = "/map",
              diagnostics = "/diagnostics";

  static constexpr auto schema() {
    return std::tuple{
        optional("points", &TopicParams::points, "", "scans: sensor_msgs/PointCloud2"),
        optional("reliable_points", &TopicParams::reliable_points, "",
                 "scans that were lost are asked for again; a sender of best effort is then not "
                 "heard"),
        optional("imu", &TopicParams::imu, "", "sensor_msgs/Imu"),
        optional("odometry", &TopicParams::odometry, "", "nav_msgs/Odometry of the robot"),
        optional("initial_pose", &TopicParams::initial_pose, "",
                 "geometry_msgs/PoseWithCovarianceStamped: where the robot is; RViz' button "
                 "sends it"),
        optional("prior", &TopicParams::prior, "",
                 "geometry_msgs/PoseWithCovarianceStamped: a repeated, rough pose of the robot"),
        optional("fix", &TopicParams::fix, "",
                 "sensor_msgs/NavSatFix: the position of the antenna; needs map_projector"),
        optional("followed_pose", &TopicParams::followed_pose, "",
                 "geometry_msgs/PoseWithCovarianceStamped of another localizer: no scan is "
                 "localized, the map of the region that it is in is published"),
        optional("pose", &TopicParams::pose, "",
                 "what is published: geometry_msgs/PoseWithCovarianceStamped of the robot"),
        optional("pose_stamped", &TopicParams::pose_stamped, "",
                 "what is published: geometry_msgs/PoseStamped of the robot"),
        optional("filtered_odometry", &TopicParams::filtered_odometry, "",
                 "what is published: nav_msgs/Odometry of the robot in the map, while it is "
                 "tracked, at the rate of the IMU, or of the scans without one"),
        optional("map", &TopicParams::map, "",
                 "what is published: sensor_msgs/PointCloud2, the region's map, at each switch"),
        optional(
            "diagnostics", &TopicParams::diagnostics, "",
            "what is published: diagnostic_msgs/DiagnosticArray, for each scan that is localized; "
            "while none is, once a second with the reason"),
    };
  }
};

/// [live.services]: what clients of ROS 2 may ask for; an empty name means that there is no such
/// service.
struct ServiceParams {
  std::string align, trigger;
  std::string align_type = "autoware_internal_localization_msgs/PoseWithCovarianceStamped";

  static constexpr auto schema() {
    return std::tuple{
        optional("align", &ServiceParams::align, "",
                 "Autoware's ndt_align_srv: the vehicle is looked for around a pose"),
        optional("trigger", &ServiceParams::trigger, "",
                 "Autoware's trigger_node_srv, std_srvs/SetBool: scans are localized, or left out"),
        optional("align_type", &ServiceParams::align_type, "",
                 "of the service `align`; Autoware before 0.45 has tier4_localization_msgs/"
                 "PoseWithCovarianceStamped"),
    };
  }
};

/// [live.frames].
struct FrameParams {
  std::string map = "map", odom = "odom", base = "base_link";
  std::optional<std::string> transform_child;
  std::optional<std::vector<double>> T_base_sensor;

  static constexpr auto schema() {
    return std::tuple{
        optional("map", &FrameParams::map, "", "the map's frame"),
        optional("odom", &FrameParams::odom, "", "the odometry's frame"),
        optional("base", &FrameParams::base, "", "the robot's frame"),
        optional("transform_child", &FrameParams::transform_child, "",
                 "what the robot's frame is called in /tf, if another node owns the name `base`"),
        optional("T_base_sensor", &FrameParams::T_base_sensor, "m, rad",
                 "pose of the LiDAR in the robot's frame: x, y, z, roll, pitch, yaw; if left out, "
                 "/tf_static says it"),
    };
  }
  /// T_base_sensor, if it is given.
  [[nodiscard]] std::optional<Pose> mount() const;
  /// T_base_sensor has six numbers.
  [[nodiscard]] Result<void> validate() const;
};

/// [live.foxglove]: what browsers, Foxglove and Lichtblick are shown.
struct FoxgloveParams {
  std::optional<std::uint32_t> port;
  std::string address = "127.0.0.1";
  std::uint32_t clients = 16;
  double buffer = 64.0;
  std::optional<std::filesystem::path> layout;

  static constexpr auto schema() {
    return std::tuple{
        optional("port", &FoxgloveParams::port, "",
                 "the server listens on this port; without a port there is no server. With 8765, a "
                 "browser shows it at http://localhost:8765/, and Foxglove finds it",
                 between(1, 65535)),
        optional("address", &FoxgloveParams::address, "",
                 "that is listened on. Whoever reaches it can see the scans and move the "
                 "localizer, so by default only this machine can; 0.0.0.0 is for all networks"),
        optional("clients", &FoxgloveParams::clients, "", "most of them at a time",
                 between(1, 1000)),
        optional("buffer", &FoxgloveParams::buffer, "MiB",
                 "of messages that wait for one client; a slower one loses the oldest",
                 between(1, 4096)),
        optional("layout", &FoxgloveParams::layout, "",
                 "file to write a layout to at the start, for these topics: import it there"),
    };
  }
  /// The address is one of IPv4 or IPv6; a layout has a server.
  [[nodiscard]] Result<void> validate() const;
};

/// [live]: what a live localizer is connected to.
struct LiveParams {
  std::uint32_t domain = 0;
  std::string node = "vantage";
  dds::Release release = dds::Release::iron_or_later;
  double receive_buffer = 8.0;
  Start start = Start::anywhere;
  std::optional<std::filesystem::path> state_file, map_projector;
  Publish publish = Publish::tracked;
  Transform transform = Transform::automatic;
  double transform_tolerance = 0.1;
  double motion_wait = 0.1;
  ForceUnit imu_unit = ForceUnit::metres_per_second_squared;
  TopicParams topics;
  ServiceParams services;
  FrameParams frames;
  FoxgloveParams foxglove;

  static constexpr auto schema() {
    return std::tuple{
        optional("domain", &LiveParams::domain, "", "ROS_DOMAIN_ID", between(0, 232)),
        optional("node", &LiveParams::node, "", "the node's name in ROS 2"),
        optional(
            "release", &LiveParams::release, "",
            "humble: ROS 2 Humble listens; iron_or_later: a newer one. How nodes and types are "
            "announced changed with Iron"),
        optional("receive_buffer", &LiveParams::receive_buffer, "MiB",
                 "of each socket; the kernel's net.core.rmem_max bounds it", positive),
        optional("start", &LiveParams::start, "",
                 "anywhere: the sensor is looked for in all regions; wait: until a pose comes on "
                 "the topic initial_pose"),
        optional("state_file", &LiveParams::state_file, "",
                 "keeps the last tracked pose; a restart begins there"),
        optional("map_projector", &LiveParams::map_projector, "",
                 "map_projector_info.yaml of Autoware: where the map is on the earth"),
        optional("publish", &LiveParams::publish, "",
                 "tracked: only poses whose risk is at most [localizer] max_risk; uncertain: also "
                 "those of uncertain scans"),
        optional(
            "transform", &LiveParams::transform, "",
            "what /tf gets: map_to_odom, map_to_base or none; auto: map_to_odom with odometry, "
            "map_to_base without"),
        optional("transform_tolerance", &LiveParams::transform_tolerance, "s",
                 "transforms from map to odom are stamped this much later than their scans, so "
                 "that they hold until the next",
                 non_negative),
        optional("motion_wait", &LiveParams::motion_wait, "s",
                 "longest time that a scan waits for the samples of IMU and odometry during its "
                 "sweep",
                 non_negative),
        optional("imu_unit", &LiveParams::imu_unit, "",
                 "of the accelerations of the IMU: m/s^2 or g"),
        optional("topics", &LiveParams::topics, "", "names of topics; \"\" for none"),
        optional("services", &LiveParams::services, "", "names of services; \"\" for none"),
        optional("frames", &LiveParams::frames, "", "names of frames"),
        optional("foxglove", &LiveParams::foxglove, "",
                 "a server for browsers, Foxglove and Lichtblick"),
    };
  }
  /// The frames differ; there are points; what needs another key has it.
  [[nodiscard]] Result<void> validate() const;

  /// What the IMU's unit of acceleration is [m/s^2].
  [[nodiscard]] double force_unit() const noexcept {
    return imu_unit == ForceUnit::g ? 9.80665 : 1.0;
  }
  /// What /tf gets, decided.
  [[nodiscard]] Transform transform_in_use() const {
    if (transform != Transform::automatic) return transform;
    return topics.odometry.empty() ? Transform::map_to_base : Transform::map_to_odom;
  }
  /// The frame that /tf gets under the map's, if any.
  [[nodiscard]] std::optional<std::string> published_child() const {
    switch (transform_in_use()) {
      case Transform::map_to_odom: return frames.odom;
      case Transform::map_to_base: return frames.transform_child.value_or(frames.base);
      case Transform::automatic:
      case Transform::none: break;
    }
    return std::nullopt;
  }
};

}  // namespace vantage::live
