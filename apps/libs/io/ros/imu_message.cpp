#include <array>

#include "io/ros/messages.hpp"
#include "io/ros/wire_reader.hpp"

namespace vantage::io::ros {
namespace {

struct Quantity {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  bool is_measured = true;
};

Result<double> first_of(WireReader& reader, std::size_t count, std::string_view what) {
  double first = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    VANTAGE_TRY(const double number, reader.number<double>(what));
    if (i == 0) first = number;
  }
  return first;
}

/// Its covariance begins with -1 if the sensor does not measure it.
Result<Quantity> read_quantity(WireReader& reader, std::string_view what) {
  constexpr std::size_t kCovariance = 9;
  Quantity found;
  for (Eigen::Index i = 0; i < 3; ++i) {
    VANTAGE_TRY(found.value[i], reader.number<double>(what));
  }
  VANTAGE_TRY(const double variance, first_of(reader, kCovariance, what));
  found.is_measured = variance != -1.0;
  return found;
}

}  // namespace

// sensor_msgs/Imu: Header header, Quaternion orientation, float64[9] orientation_covariance,
// Vector3 angular_velocity, float64[9] angular_velocity_covariance, Vector3 linear_acceleration,
// float64[9] linear_acceleration_covariance.
Result<ImuMessage> parse_imu(std::string_view bytes, Encoding encoding,
                             const SourceLocation& where) {
  constexpr std::size_t kOrientation = 4 + 9;
  VANTAGE_TRY(auto reader, WireReader::open(bytes, encoding, where));
  ImuMessage message;
  VANTAGE_TRY(message.header, reader.header());
  VANTAGE_CHECK(first_of(reader, kOrientation, "orientation"));
  VANTAGE_TRY(const auto rate, read_quantity(reader, "angular_velocity"));
  VANTAGE_TRY(const auto force, read_quantity(reader, "linear_acceleration"));
  message.angular_velocity = rate.value;
  message.linear_acceleration = force.value;
  message.is_measured = rate.is_measured && force.is_measured;
  return message;
}

}  // namespace vantage::io::ros
