#include "live/received.hpp"

#include <utility>

namespace vantage::live {

std::string_view name_of(Input input) {
  switch (input) {
    case Input::points: return "points";
    case Input::imu: return "imu";
    case Input::odometry: return "odometry";
    case Input::initial_pose: return "initial_pose";
    case Input::prior: return "prior";
    case Input::fix: return "fix";
    case Input::followed_pose: return "followed_pose";
    case Input::static_transforms: return "static_transforms";
    case Input::transforms: return "transforms";
    case Input::align: return "align";
    case Input::trigger: return "trigger";
  }
  return "unknown";
}

std::vector<InputTopic> input_topics(const TopicParams& topics) {
  constexpr const char* kPose = "geometry_msgs/PoseWithCovarianceStamped";
  const dds::Qos sensor{.reliable = false, .transient_local = false, .depth = 1};
  dds::Qos points = sensor;
  points.reliable = topics.reliable_points;
  dds::Qos samples = sensor;
  samples.depth = 1000;  // half a second at 2 kHz
  const dds::Qos command{.reliable = true, .transient_local = false, .depth = 10};
  const dds::Qos latched{.reliable = true, .transient_local = true, .depth = 100};
  std::vector<InputTopic> inputs;
  const auto add = [&](Input input, const std::string& name, const char* type, dds::Qos qos) {
    if (!name.empty()) inputs.push_back({input, {.name = name, .type = type, .qos = qos}});
  };
  if (!topics.followed_pose.empty()) {
    add(Input::initial_pose, topics.initial_pose, kPose, command);
    add(Input::followed_pose, topics.followed_pose, kPose, sensor);
    return inputs;
  }
  add(Input::static_transforms, "/tf_static", "tf2_msgs/TFMessage", latched);
  add(Input::transforms, "/tf", "tf2_msgs/TFMessage", samples);
  add(Input::imu, topics.imu, "sensor_msgs/Imu", samples);
  add(Input::odometry, topics.odometry, "nav_msgs/Odometry", samples);
  add(Input::initial_pose, topics.initial_pose, kPose, command);
  add(Input::prior, topics.prior, kPose, samples);
  add(Input::fix, topics.fix, "sensor_msgs/NavSatFix", samples);
  add(Input::points, topics.points, "sensor_msgs/PointCloud2", points);
  return inputs;
}

std::vector<InputService> input_services(const ServiceParams& services) {
  std::vector<InputService> inputs;
  if (!services.align.empty()) {
    inputs.push_back({Input::align, {.name = services.align, .type = services.align_type}});
  }
  if (!services.trigger.empty()) {
    inputs.push_back({Input::trigger, {.name = services.trigger, .type = "std_srvs/SetBool"}});
  }
  return inputs;
}

}  // namespace vantage::live
