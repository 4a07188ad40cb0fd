#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "support/bags/message_writer.hpp"

namespace vantage::test {

/// The members of a sensor_msgs/NavSatFix that tests change.
struct TestFix {
  std::uint32_t seconds = 0;
  std::string frame = "gnss";
  std::int8_t status = 0;
  double latitude = 35.6586, longitude = 139.7454, altitude = 50.0;
  std::array<double, 9> covariance{4.0, 0.5, 0.0, 0.5, 9.0, 0.0, 0.0, 0.0, 16.0};
  std::uint8_t covariance_type = 3;
};

inline std::string nav_sat_fix(const TestFix& fix, MessageWriter::Layout layout) {
  MessageWriter message(layout);
  message.header(fix.seconds, 500'000'000, fix.frame);
  message.number(fix.status).number(std::uint16_t{1});
  message.number(fix.latitude).number(fix.longitude).number(fix.altitude);
  message.numbers(fix.covariance).number(fix.covariance_type);
  return message.bytes();
}

}  // namespace vantage::test
