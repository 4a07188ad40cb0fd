#include "io/ros/messages.hpp"

#include "io/ros/wire_reader.hpp"

namespace vantage::io::ros {

double seconds_from(std::int64_t nanoseconds) noexcept {
  constexpr std::int64_t kPerSecond = 1'000'000'000;
  return static_cast<double>(nanoseconds / kPerSecond) +
         static_cast<double>(nanoseconds % kPerSecond) / static_cast<double>(kPerSecond);
}

Result<Header> parse_header(std::string_view bytes, Encoding encoding,
                            const SourceLocation& where) {
  VANTAGE_TRY(auto reader, WireReader::open(bytes, encoding, where));
  return reader.header();
}

Result<bool> parse_set_bool(std::string_view bytes, Encoding encoding,
                            const SourceLocation& where) {
  VANTAGE_TRY(auto reader, WireReader::open(bytes, encoding, where));
  VANTAGE_TRY(const auto data, reader.number<std::uint8_t>("data"));
  return data != 0;
}

// velodyne_msgs/VelodyneScan: Header header, VelodynePacket[] packets; a packet: time stamp,
// uint8[1206] data.
Result<VelodyneScanMessage> parse_velodyne_scan(std::string_view bytes, Encoding encoding,
                                                const SourceLocation& where) {
  constexpr std::size_t kTime = 8, kData = 1206;  // [bytes]
  VANTAGE_TRY(auto reader, WireReader::open(bytes, encoding, where));
  VelodyneScanMessage scan;
  VANTAGE_TRY(scan.header, reader.header());
  VANTAGE_TRY(const auto packets, reader.count(kTime + kData, "packets"));
  scan.packets.resize(packets);
  for (VelodynePacket& packet : scan.packets) {
    VANTAGE_TRY(packet.stamp, reader.time("packets.stamp"));
    VANTAGE_TRY(packet.data, reader.bytes(kData, "packets.data"));
  }
  return scan;
}

}  // namespace vantage::io::ros
