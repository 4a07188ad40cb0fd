#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "io/ros/messages.hpp"
#include "io/ros/wire_reader.hpp"
#include "io/text.hpp"

namespace vantage::io::ros {
namespace {

constexpr double kRotationTolerance = 1e-3;  // as in files with trajectories

// geometry_msgs/Pose (Point position, Quaternion orientation) or Transform (Vector3 translation,
// Quaternion rotation): seven numbers of float64, x y z and x y z w.
using Numbers = std::array<double, 7>;

/// The pose, or what is wrong with it. @param end  in the message, for errors [bytes]
tl::expected<Pose, std::string> pose_from(const Numbers& v, std::size_t end) {
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (std::isfinite(v[i])) continue;
    return tl::unexpected(
        fmt::format("number {} of 7 of the pose that ends at byte {} is {}, expected finite "
                    "numbers",
                    i + 1, end, v[i]));
  }
  Pose pose;
  pose.translation = {v[0], v[1], v[2]};
  pose.rotation = {v[6], v[3], v[4], v[5]};
  const double norm = pose.rotation.norm();
  if (!(std::abs(norm - 1.0) <= kRotationTolerance)) {
    return tl::unexpected(
        fmt::format("the quaternion that ends at byte {} has length {}, expected 1 to within {}",
                    end, norm, kRotationTolerance));
  }
  // A quaternion that is already normalized keeps its bits.
  constexpr double kRounding = 8.0 * std::numeric_limits<double>::epsilon();
  if (std::abs(pose.rotation.squaredNorm() - 1.0) > kRounding) pose.rotation.normalize();
  return pose;
}

/// Adds the next pose to a message.
Result<PoseMessage> with_pose(PoseMessage message, WireReader& reader) {
  Numbers numbers{};
  for (double& number : numbers) {
    VANTAGE_TRY(number, reader.number<double>("a pose"));
  }
  auto pose = pose_from(numbers, reader.offset());
  if (pose) {
    message.pose = *pose;
  } else {
    message.problem = std::move(pose).error();
  }
  return message;
}

Result<void> skip_numbers(WireReader& reader, std::size_t count, std::string_view what) {
  for (std::size_t i = 0; i < count; ++i) VANTAGE_CHECK(reader.number<double>(what));
  return {};
}

constexpr std::size_t kCovariance = 36;  // numbers of a row-major 6x6 matrix: x y z, about x y z
constexpr std::size_t kTwist = 6;

Result<PoseVariances> read_variances(WireReader& reader) {
  std::array<double, kCovariance> numbers{};
  for (double& number : numbers) {
    VANTAGE_TRY(number, reader.number<double>("pose.covariance"));
  }
  return PoseVariances{.translation = {numbers[0], numbers[7], numbers[14]},
                       .heading = numbers[35]};
}

// Header header, Pose pose.
Result<PoseMessage> read_pose_stamped(WireReader& reader) {
  PoseMessage message;
  VANTAGE_TRY(message.header, reader.header());
  return with_pose(std::move(message), reader);
}

// Header header, PoseWithCovariance pose.
Result<PoseMessage> read_pose_with_covariance_stamped(WireReader& reader) {
  VANTAGE_TRY(auto message, read_pose_stamped(reader));
  VANTAGE_TRY(message.variances, read_variances(reader));
  return message;
}

// Header header, string child_frame_id, Transform transform.
Result<PoseMessage> read_transform_stamped(WireReader& reader) {
  PoseMessage message;
  VANTAGE_TRY(message.header, reader.header());
  VANTAGE_TRY(message.child, reader.text("child_frame_id"));
  return with_pose(std::move(message), reader);
}

// Header header, string child_frame_id, PoseWithCovariance pose, TwistWithCovariance twist.
Result<PoseMessage> read_odometry(WireReader& reader) {
  VANTAGE_TRY(auto message, read_transform_stamped(reader));
  VANTAGE_TRY(message.variances, read_variances(reader));
  VANTAGE_CHECK(skip_numbers(reader, kTwist + kCovariance, "twist"));
  return message;
}

struct Type {
  std::string_view name;
  Result<PoseMessage> (*read)(WireReader&) = nullptr;
  bool is_array = false;
};
constexpr std::array<Type, 6> kTypes{{
    {"nav_msgs/Odometry", read_odometry, false},
    {"geometry_msgs/PoseStamped", read_pose_stamped, false},
    {"geometry_msgs/PoseWithCovarianceStamped", read_pose_with_covariance_stamped, false},
    {"geometry_msgs/TransformStamped", read_transform_stamped, false},
    {"tf2_msgs/TFMessage", read_transform_stamped, true},
    {"tf/tfMessage", read_transform_stamped, true},
}};

const Type* find_type(std::string_view name) noexcept {
  const auto found = std::find_if(kTypes.begin(), kTypes.end(),
                                  [&](const Type& type) { return type.name == name; });
  return found == kTypes.end() ? nullptr : &*found;
}

}  // namespace

bool has_poses(std::string_view type) noexcept { return find_type(type) != nullptr; }

Result<std::vector<PoseMessage>> parse_poses(std::string_view bytes, std::string_view type,
                                             Encoding encoding, const SourceLocation& where) {
  // A time, two strings without a letter and seven numbers [bytes].
  constexpr std::size_t kShortest = 8 + 4 + 4 + 7 * 8;
  const Type* const known = find_type(type);
  if (known == nullptr) {
    return fail(ErrorCode::invalid_input,
                fmt::format("messages of {} hold no poses that are known", quoted(type)), where);
  }
  VANTAGE_TRY(auto reader, WireReader::open(bytes, encoding, where));
  std::size_t count = 1;
  if (known->is_array) {
    VANTAGE_TRY(count, reader.count(kShortest, "transforms"));
  }
  std::vector<PoseMessage> poses;
  poses.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    VANTAGE_TRY(auto pose, known->read(reader));
    if (!known->is_array && !pose.problem.empty()) return reader.error(std::move(pose.problem));
    poses.push_back(std::move(pose));
  }
  return poses;
}

}  // namespace vantage::io::ros
