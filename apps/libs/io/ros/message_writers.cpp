#include "io/ros/message_writers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/ros/cdr_writer.hpp"
#include "io/ros/ros_time.hpp"

namespace vantage::io::ros {
namespace {

constexpr std::uint8_t kFloat32 = 7, kFloat64 = 8;  // sensor_msgs/PointField

Result<void> write(CdrWriter& out, const Header& header) {
  VANTAGE_TRY(const Time time, header.stamp.time());
  out.number(time.sec);
  out.number(time.nanosec);
  out.text(header.frame);
  return {};
}

/// geometry_msgs/Pose and geometry_msgs/Transform have the same layout.
void write(CdrWriter& out, const Pose& pose) {
  for (const double x : pose.translation) out.number(x);
  for (const double x : pose.rotation.coeffs()) out.number(x);  // x, y, z, w
}

void write(CdrWriter& out, const PoseCovariance& covariance) {
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = 0; column < 6; ++column) out.number(covariance(row, column));
  }
}

Result<void> write_pose_with_covariance(CdrWriter& out, const Header& header, const Pose& pose,
                                        const PoseCovariance& covariance) {
  VANTAGE_CHECK(write(out, header));
  write(out, pose);
  write(out, covariance);
  return {};
}

void write_field(CdrWriter& out, std::string_view name, std::uint32_t offset, std::uint8_t type) {
  out.text(name);
  out.number(offset);
  out.number(type);
  out.count(1);
}

bool fits(double x) { return std::abs(x) <= std::numeric_limits<float>::max(); }

void append_coordinate(std::string& data, double x, Coordinates coordinates) {
  if (!fits(x)) x = std::numeric_limits<double>::quiet_NaN();
  if (coordinates == Coordinates::float64) return append_little_endian(data, x);
  append_little_endian(data, static_cast<float>(x));
}

std::size_t size_of(Coordinates coordinates) {
  return coordinates == Coordinates::float64 ? sizeof(double) : sizeof(float);
}

Result<void> check(PointsView points, std::span<const CloudField> more, std::size_t step) {
  for (const CloudField& field : more) {
    if (field.values.size() != points.size()) {
      return fail(ErrorCode::invalid_input,
                  fmt::format("field '{}' has {} values for {} points", field.name,
                              field.values.size(), points.size()));
    }
  }
  if (points.size() > std::numeric_limits<std::uint32_t>::max() / step) {
    return fail(
        ErrorCode::invalid_input,
        fmt::format("{} points of {} bytes are more than a message holds", points.size(), step));
  }
  return {};
}

}  // namespace

Coordinates coordinates_for(PointsView points) {
  constexpr double kMost = 0.001;      // [m]
  constexpr double kPrecise = 0x1p15;  // [m]; below, half a digit of float32 is less than kMost
  constexpr int kDigits = std::numeric_limits<float>::digits;
  const auto is_moved = [](double x) {
    if (std::abs(x) < kPrecise || !fits(x)) return false;
    const double last_digit = std::ldexp(1.0, std::ilogb(x) + 1 - kDigits);
    return std::abs(std::remainder(x, last_digit)) > kMost;
  };
  const bool moves = std::ranges::any_of(points, [&](const Point& p) {
    return is_moved(p.x()) || is_moved(p.y()) || is_moved(p.z());
  });
  return moves ? Coordinates::float64 : Coordinates::float32;
}

Result<std::string> write_point_cloud2(const Header& header, PointsView points,
                                       std::span<const CloudField> more, Coordinates coordinates) {
  const std::size_t of_coordinate = size_of(coordinates);
  const std::size_t step = 3 * of_coordinate + sizeof(float) * more.size();
  VANTAGE_CHECK(check(points, more, step));
  CdrWriter out;
  VANTAGE_CHECK(write(out, header));
  out.number(std::uint32_t{1});  // height: no rows
  out.count(points.size());
  out.count(3 + more.size());
  std::uint32_t offset = 0;
  for (const std::string_view name : {"x", "y", "z"}) {
    write_field(out, name, offset, coordinates == Coordinates::float64 ? kFloat64 : kFloat32);
    offset += static_cast<std::uint32_t>(of_coordinate);
  }
  for (const CloudField& field : more) {
    write_field(out, field.name, offset, kFloat32);
    offset += sizeof(float);
  }
  out.number(std::uint8_t{0});  // is_bigendian
  out.number(offset);           // point_step
  const std::size_t size = step * points.size();
  out.count(size);  // row_step
  std::string data;
  data.reserve(size);
  bool dense = true;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double x : points[i]) {
      dense = dense && fits(x);
      append_coordinate(data, x, coordinates);
    }
    for (const CloudField& field : more) append_little_endian(data, field.values[i]);
  }
  out.count(size);
  out.raw(data);
  out.number(static_cast<std::uint8_t>(dense));
  return std::move(out).finish();
}

Result<std::string> write_pose_stamped(const Header& header, const Pose& pose) {
  CdrWriter out;
  VANTAGE_CHECK(write(out, header));
  write(out, pose);
  return std::move(out).finish();
}

Result<std::string> write_pose_with_covariance(const Header& header, const Pose& pose,
                                               const PoseCovariance& covariance) {
  CdrWriter out;
  VANTAGE_CHECK(write_pose_with_covariance(out, header, pose, covariance));
  return std::move(out).finish();
}

Result<std::string> write_odometry(const Header& header, std::string_view child,
                                   const Pose& T_frame_child, const PoseCovariance& covariance,
                                   const Twist& twist) {
  CdrWriter out;
  VANTAGE_CHECK(write(out, header));
  out.text(child);
  write(out, T_frame_child);
  write(out, covariance);
  for (const double x : twist.linear) out.number(x);
  for (const double x : twist.angular) out.number(x);
  write(out, PoseCovariance::Zero());
  return std::move(out).finish();
}

Result<std::string> write_imu(const Header& header, const Eigen::Vector3d& angular_velocity,
                              const Eigen::Vector3d& linear_acceleration) {
  const auto covariance = [](CdrWriter& out, double first) {
    out.number(first);
    for (int i = 1; i < 9; ++i) out.number(0.0);
  };
  CdrWriter out;
  VANTAGE_CHECK(write(out, header));
  for (const double x : {0.0, 0.0, 0.0, 1.0}) out.number(x);
  covariance(out, -1.0);  // there is no orientation
  for (const double x : angular_velocity) out.number(x);
  covariance(out, 0.0);
  for (const double x : linear_acceleration) out.number(x);
  covariance(out, 0.0);
  return std::move(out).finish();
}

Result<std::string> write_set_bool_answer(bool success, std::string_view message) {
  CdrWriter out;
  out.number(static_cast<std::uint8_t>(success));
  out.text(message);
  return std::move(out).finish();
}

Result<std::string> write_align_answer(bool success, bool reliable, const Header& header,
                                       const Pose& pose, const PoseCovariance& covariance) {
  CdrWriter out;
  out.number(static_cast<std::uint8_t>(success));
  out.number(static_cast<std::uint8_t>(reliable));
  VANTAGE_CHECK(write_pose_with_covariance(out, header, pose, covariance));
  return std::move(out).finish();
}

Result<std::string> write_string(std::string_view text) {
  CdrWriter out;
  out.text(text);
  return std::move(out).finish();
}

Result<std::string> write_transforms(std::span<const PoseMessage> transforms) {
  CdrWriter out;
  out.count(transforms.size());
  for (const PoseMessage& transform : transforms) {
    VANTAGE_CHECK(write(out, transform.header));
    out.text(transform.child);
    write(out, transform.pose);
  }
  return std::move(out).finish();
}

Result<std::string> write_diagnostics(const Header& header,
                                      std::span<const Diagnostic> diagnostics) {
  CdrWriter out;
  VANTAGE_CHECK(write(out, header));
  out.count(diagnostics.size());
  for (const Diagnostic& diagnostic : diagnostics) {
    out.number(static_cast<std::uint8_t>(diagnostic.level));
    out.text(diagnostic.name);
    out.text(diagnostic.message);
    out.text("");  // hardware_id
    out.count(diagnostic.values.size());
    for (const auto& [key, value] : diagnostic.values) {
      out.text(key);
      out.text(value);
    }
  }
  return std::move(out).finish();
}

}  // namespace vantage::io::ros
