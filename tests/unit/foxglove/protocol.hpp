#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "dds/participant.hpp"

namespace vantage::test {

using Json = nlohmann::json;

inline const dds::Topic kRisk{.name = "/risk", .type = "std_msgs/Float64"};
inline const dds::Topic kMap{.name = "/map",
                             .type = "sensor_msgs/PointCloud2",
                             .qos = {.transient_local = true, .depth = 1}};
inline const dds::Topic kStatic{.name = "/tf_static",
                                .type = "tf2_msgs/TFMessage",
                                .qos = {.transient_local = true, .depth = 3}};

inline std::uint64_t little_endian(std::string_view bytes) {
  std::uint64_t number = 0;
  for (std::size_t i = bytes.size(); i > 0; --i) {
    number = number << 8U | static_cast<std::uint8_t>(bytes[i - 1]);
  }
  return number;
}

/// A binary frame of the server.
struct Data {
  std::uint64_t opcode, subscription, time;
  std::string message;
};
inline Data data_of(const std::string& frame) {
  if (frame.size() < 13) return {};
  const std::string_view bytes(frame);
  return {little_endian(bytes.substr(0, 1)), little_endian(bytes.substr(1, 4)),
          little_endian(bytes.substr(5, 8)), frame.substr(13)};
}

inline std::string subscribe(std::uint32_t id, std::uint32_t channel) {
  return Json{{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel}}}}}
      .dump();
}

inline std::string advertise(std::uint32_t id, const std::string& topic, const std::string& type,
                             const std::string& encoding) {
  return Json{
      {"op", "advertise"},
      {"channels", {{{"id", id}, {"topic", topic}, {"encoding", encoding}, {"schemaName", type}}}}}
      .dump();
}

/// A binary frame of a client.
inline std::string message(std::uint32_t channel, std::string_view bytes) {
  std::string frame(1, '\1');
  for (unsigned shift = 0; shift < 32; shift += 8) {
    frame += static_cast<char>(channel >> shift & 0xFFU);
  }
  return frame + std::string(bytes);
}

/// A pose as a browser writes it in JSON.
inline Json pose_in_json() {
  return {{"header", {{"stamp", {{"sec", 12}, {"nsec", 500}}}, {"frame_id", "map"}}},
          {"pose",
           {{"position", {{"x", 1.5}, {"y", -2}, {"z", 0}}},
            {"orientation", {{"x", 0}, {"y", 0}, {"z", 0.6}, {"w", 0.8}}}}}};
}

}  // namespace vantage::test
