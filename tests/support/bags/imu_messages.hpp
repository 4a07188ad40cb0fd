#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include "support/bags/message_writer.hpp"

namespace vantage::test {

/// The members of a sensor_msgs/Imu that tests change.
struct TestImu {
  std::uint32_t seconds = 0, nanoseconds = 0;
  std::string frame = "imu";
  std::array<double, 3> rate{}, force{0.0, 0.0, 9.81};
  double rate_variance = 0.0, force_variance = 0.0;  ///< the first number of the covariances
};

/// Its orientation is unknown, all NaN.
inline std::string imu_message(const TestImu& imu, MessageWriter::Layout layout) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  MessageWriter message(layout);
  message.header(imu.seconds, imu.nanoseconds, imu.frame);
  message.numbers(std::array{kNan, kNan, kNan, kNan});
  message.numbers(std::array<double, 9>{-1.0});
  message.numbers(imu.rate).numbers(std::array<double, 9>{imu.rate_variance});
  message.numbers(imu.force).numbers(std::array<double, 9>{imu.force_variance});
  return message.bytes();
}

}  // namespace vantage::test
