#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace vantage::test {

/// A data packet of a Velodyne sensor to write.
struct VelodynePacket {
  std::uint8_t product = 0x22;  ///< VLP-16
  std::uint8_t mode = 0x37;     ///< strongest return
  std::uint32_t timestamp = 0;  ///< [us] past the hour
  std::array<std::uint16_t, 12> azimuths{};
  /// [2 mm] of a channel of a block
  std::function<std::uint16_t(std::size_t block, std::size_t channel)> distance =
      [](std::size_t, std::size_t) { return std::uint16_t{500}; };
};

/// Its 1206 bytes.
std::string to_bytes(const VelodynePacket& packet);

/// The packets of a sensor that turns evenly at 10 Hz, without end: each follows the one before.
class VelodyneSensor {
 public:
  /// @param azimuth  at the beginning [1/100 deg]
  VelodyneSensor(std::uint8_t product, std::uint8_t mode, double azimuth, double seconds);
  VelodynePacket next();
  /// As if so many packets had been lost.
  void skip(std::size_t packets);
  /// Of the next packet's first firing [s].
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  [[nodiscard]] double column_time() const;
  [[nodiscard]] std::size_t columns() const { return mode_ == 0x39 ? 6 : 12; }

  std::uint8_t product_, mode_;
  double azimuth_, seconds_;
};

/// Frames around a payload.
std::string udp(std::string_view payload, std::uint16_t source_port = 2368,
                std::uint16_t destination_port = 2368);
std::string ipv4(std::string_view udp, std::array<std::uint8_t, 4> source = {192, 168, 1, 201},
                 std::uint16_t fragment = 0, std::uint8_t protocol = 17);
std::string ipv6(std::string_view udp, std::uint8_t next_header = 17);
std::string ethernet(std::string_view ip, std::uint16_t protocol = 0x0800,
                     const std::vector<std::uint16_t>& vlan_types = {});

struct CapturedFrame {
  double stamp = 0.0;  ///< [s]
  std::string bytes;
  std::uint32_t cut = 0xFFFFFFFF;  ///< captured bytes at most
};
/// A pcap file of microseconds. @param link_type  LINKTYPE_ number
std::string pcap(const std::vector<CapturedFrame>& frames, std::uint32_t link_type = 1);
std::string pcapng(const std::vector<CapturedFrame>& frames, std::uint16_t link_type = 1);

/// A capture of so many packets of a sensor, one after the other, received as they were sent.
std::vector<CapturedFrame> captured(VelodyneSensor sensor, std::size_t packets,
                                    double clock_offset = 0.0,
                                    std::array<std::uint8_t, 4> source = {192, 168, 1, 201});

}  // namespace vantage::test
