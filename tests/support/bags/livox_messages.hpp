#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "support/bags/message_writer.hpp"

namespace vantage::test {

struct LivoxPoint {
  std::uint32_t offset = 0;  ///< [ns]
  float x = 1.0F;            ///< y and z are twice and three times that
  std::uint8_t tag = 0;
};

/// The members of a livox_ros_driver(2)/CustomMsg that tests change.
struct TestLivox {
  std::uint32_t seconds = 0;
  std::vector<LivoxPoint> points;
};

/// Stamped half a second after `seconds`.
inline std::string livox_message(const TestLivox& scan, MessageWriter::Layout layout) {
  MessageWriter message(layout);
  message.header(scan.seconds, 500'000'000, "livox_frame");
  message.number(std::uint64_t{1'000'000'000} * scan.seconds + 500'000'000);  // timebase
  message.number(std::uint32_t{4711});  // point_num, which filters do not keep up to date
  for (const int value : {192, 1, 2, 3}) message.number(static_cast<std::uint8_t>(value));
  message.number(static_cast<std::uint32_t>(scan.points.size()));
  for (const LivoxPoint& point : scan.points) {
    message.number(point.offset);
    for (const float factor : {1.0F, 2.0F, 3.0F}) message.number(factor * point.x);
    message.number(std::uint8_t{77}).number(point.tag).number(std::uint8_t{3});
  }
  return message.bytes();
}

}  // namespace vantage::test
