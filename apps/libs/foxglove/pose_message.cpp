#include "foxglove/pose_message.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>

#include "io/ros/cdr_writer.hpp"
#include "io/ros/message_writers.hpp"
#include "io/ros/messages.hpp"

namespace vantage::foxglove {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kPoseStamped = "geometry_msgs/PoseStamped";
constexpr std::string_view kPoseWithCovariance = "geometry_msgs/PoseWithCovarianceStamped";

/// In ROS 1's spelling.
std::string plain(std::string_view type) {
  const std::size_t slash = type.find("/msg/");
  if (slash == std::string_view::npos) return std::string(type);
  return fmt::format("{}/{}", type.substr(0, slash), type.substr(slash + 5));
}

/// 0.5 m along x and y and 15 degrees about z; nothing is known of the rest.
io::ros::PoseCovariance covariance_of_a_hand() {
  io::ros::PoseCovariance covariance = io::ros::PoseCovariance::Zero();
  covariance(0, 0) = covariance(1, 1) = 0.25;
  covariance(5, 5) = 0.06853891909122467;
  return covariance;
}

/// Reads members of an object in JSON; the first that is missing or wrong is kept as the error.
class Members {
 public:
  [[nodiscard]] const Json& at(const Json& object, const char* name) {
    static const Json kNone;
    if (object.is_object()) {
      if (const auto found = object.find(name); found != object.end()) return *found;
    }
    refuse(name);
    return kNone;
  }
  [[nodiscard]] double number(const Json& value, std::string_view name) {
    if (value.is_number()) return value.get<double>();
    refuse(name);
    return 0.0;
  }
  template <class Integer>
  [[nodiscard]] Integer integer(const Json& value, std::string_view name) {
    if (value.is_number_integer()) {
      const auto wide = value.get<std::int64_t>();
      if (std::in_range<Integer>(wide)) return static_cast<Integer>(wide);
    }
    refuse(name);
    return 0;
  }
  [[nodiscard]] std::string text(const Json& value, std::string_view name) {
    if (value.is_string()) return value.get<std::string>();
    refuse(name);
    return {};
  }
  void refuse(std::string_view name) {
    if (missing_.empty()) missing_ = name;
  }
  [[nodiscard]] const std::string& missing() const noexcept { return missing_; }

 private:
  std::string missing_;
};

/// The CDR of a message in JSON, of the same type.
Result<std::string> encode(std::string_view bytes, bool has_covariance) {
  const Json message = Json::parse(bytes, nullptr, false);
  if (!message.is_object()) {
    return fail(ErrorCode::corrupt_data, "a pose in JSON is no JSON object");
  }
  Members members;
  io::ros::CdrWriter out;
  const Json& header = members.at(message, "header");
  const Json& stamp = members.at(header, "stamp");
  out.number(members.integer<std::int32_t>(members.at(stamp, "sec"), "sec"));
  const bool is_ros1 = stamp.is_object() && stamp.contains("nsec");
  out.number(
      members.integer<std::uint32_t>(members.at(stamp, is_ros1 ? "nsec" : "nanosec"), "nanosec"));
  out.text(members.text(members.at(header, "frame_id"), "frame_id"));
  const Json& outer = members.at(message, "pose");
  const Json& pose = has_covariance ? members.at(outer, "pose") : outer;
  const Json& position = members.at(pose, "position");
  for (const char* name : {"x", "y", "z"}) {
    out.number(members.number(members.at(position, name), name));
  }
  const Json& orientation = members.at(pose, "orientation");
  for (const char* name : {"x", "y", "z", "w"}) {
    out.number(members.number(members.at(orientation, name), name));
  }
  if (has_covariance) {
    const Json& covariance = members.at(outer, "covariance");
    if (!covariance.is_array() || covariance.size() != 36) members.refuse("covariance");
    for (const Json& one : covariance) out.number(members.number(one, "covariance"));
  }
  if (!members.missing().empty()) {
    return fail(ErrorCode::corrupt_data,
                fmt::format("a pose in JSON has no '{}', or it is of another kind or beyond its "
                            "range",
                            members.missing()));
  }
  return std::move(out).finish();
}

}  // namespace

bool is_pose(std::string_view type) noexcept {
  return type == kPoseStamped || type == kPoseWithCovariance ||
         type == "geometry_msgs/msg/PoseStamped" ||
         type == "geometry_msgs/msg/PoseWithCovarianceStamped";
}

Result<std::string> given_pose(std::string_view type, std::string_view encoding,
                               std::string_view bytes) {
  if (!is_pose(type) || (encoding != kCdr && encoding != kJson)) {
    return fail(ErrorCode::unsupported,
                fmt::format("'{}' in '{}' is no pose, expected {} or {} in {} or {}", type,
                            encoding, kPoseWithCovariance, kPoseStamped, kCdr, kJson));
  }
  const std::string name = plain(type);
  const bool has_covariance = name == kPoseWithCovariance;
  std::string message(bytes);
  if (encoding == kJson) {
    VANTAGE_TRY(message, encode(bytes, has_covariance));
  }
  VANTAGE_TRY(const auto poses, io::ros::parse_poses(message, name, io::ros::Encoding::cdr,
                                                     {.file = "a given pose"}));
  if (has_covariance) return message;
  const io::ros::PoseMessage& only = poses.front();
  return io::ros::write_pose_with_covariance(only.header, only.pose, covariance_of_a_hand());
}

}  // namespace vantage::foxglove
