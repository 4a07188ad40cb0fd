#include "support/captures/velodyne_captures.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace vantage::test {
namespace {

template <class Number>
void put(std::string& bytes, Number number) {
  std::array<char, sizeof(Number)> raw;
  std::memcpy(raw.data(), &number, raw.size());
  bytes.append(raw.data(), raw.size());
}
void put_network(std::string& bytes, std::uint16_t number) {
  bytes += static_cast<char>(number >> 8U);
  bytes += static_cast<char>(number & 0xFFU);
}
std::uint64_t micros(double seconds) {
  return static_cast<std::uint64_t>(std::llround(seconds * 1e6));
}

}  // namespace

std::string to_bytes(const VelodynePacket& packet) {
  std::string bytes;
  for (std::size_t block = 0; block < packet.azimuths.size(); ++block) {
    put<std::uint16_t>(bytes, 0xEEFF);
    put(bytes, packet.azimuths[block]);
    for (std::size_t channel = 0; channel < 32; ++channel) {
      put(bytes, packet.distance(block, channel));
      put<std::uint8_t>(bytes, 77);
    }
  }
  put(bytes, packet.timestamp);
  put(bytes, packet.mode);
  put(bytes, packet.product);
  return bytes;
}

VelodyneSensor::VelodyneSensor(std::uint8_t product, std::uint8_t mode, double azimuth,
                               double seconds)
    : product_(product), mode_(mode), azimuth_(azimuth), seconds_(seconds) {}

double VelodyneSensor::column_time() const { return product_ == 0x21 ? 46.08e-6 : 110.592e-6; }

void VelodyneSensor::skip(std::size_t packets) {
  const double time = static_cast<double>(packets * columns()) * column_time();
  seconds_ += time;
  azimuth_ = std::fmod(azimuth_ + time * 360'000.0, 36'000.0);
}

VelodynePacket VelodyneSensor::next() {
  VelodynePacket packet;
  packet.product = product_;
  packet.mode = mode_;
  // The HDL-32E writes the time of the packet's last firing.
  const double last = static_cast<double>(columns() - 1) * column_time() + 31 * 1.152e-6;
  packet.timestamp = static_cast<std::uint32_t>(micros(seconds_ + (product_ == 0x21 ? last : 0.0)) %
                                                3'600'000'000U);
  for (std::size_t block = 0; block < packet.azimuths.size(); ++block) {
    const std::size_t column = mode_ == 0x39 ? block / 2 : block;
    const double azimuth = azimuth_ + static_cast<double>(column) * column_time() * 360'000.0;
    packet.azimuths[block] = static_cast<std::uint16_t>(std::llround(azimuth) % 36'000);
  }
  skip(1);
  return packet;
}

std::string udp(std::string_view payload, std::uint16_t source_port,
                std::uint16_t destination_port) {
  std::string bytes;
  put_network(bytes, source_port);
  put_network(bytes, destination_port);
  put_network(bytes, static_cast<std::uint16_t>(payload.size() + 8));
  put_network(bytes, 0);
  return bytes.append(payload);
}

std::string ipv4(std::string_view udp, std::array<std::uint8_t, 4> source, std::uint16_t fragment,
                 std::uint8_t protocol) {
  std::string bytes("\x45\x00", 2);
  put_network(bytes, static_cast<std::uint16_t>(udp.size() + 20));
  put_network(bytes, 1);
  put_network(bytes, fragment);
  bytes += static_cast<char>(255);
  bytes += static_cast<char>(protocol);
  put_network(bytes, 0);
  for (const std::uint8_t byte : source) bytes += static_cast<char>(byte);
  bytes.append("\xFF\xFF\xFF\xFF");
  return bytes.append(udp);
}

std::string ipv6(std::string_view udp, std::uint8_t next_header) {
  std::string bytes("\x60\x00\x00\x00", 4);
  put_network(bytes, static_cast<std::uint16_t>(udp.size()));
  bytes += static_cast<char>(next_header);
  bytes += static_cast<char>(64);
  bytes += std::string("\xFE\x80", 2) + std::string(13, '\0') + '\x01';
  bytes += std::string(16, '\xFF');
  return bytes.append(udp);
}

std::string ethernet(std::string_view ip, std::uint16_t protocol,
                     const std::vector<std::uint16_t>& vlan_types) {
  std::string bytes(12, '\x02');
  for (const std::uint16_t type : vlan_types) {
    put_network(bytes, type);
    put_network(bytes, 5);
  }
  put_network(bytes, protocol);
  return bytes.append(ip);
}

std::string pcap(const std::vector<CapturedFrame>& frames, std::uint32_t link_type) {
  std::string bytes;
  put<std::uint32_t>(bytes, 0xA1B2C3D4);
  put<std::uint16_t>(bytes, 2);
  put<std::uint16_t>(bytes, 4);
  put<std::uint64_t>(bytes, 0);
  put<std::uint32_t>(bytes, 65535);
  put(bytes, link_type);
  for (const CapturedFrame& frame : frames) {
    const std::uint64_t stamp = micros(frame.stamp);
    const auto size = static_cast<std::uint32_t>(frame.bytes.size());
    put(bytes, static_cast<std::uint32_t>(stamp / 1'000'000));
    put(bytes, static_cast<std::uint32_t>(stamp % 1'000'000));
    put(bytes, std::min(size, frame.cut));
    put(bytes, size);
    bytes.append(frame.bytes, 0, frame.cut);
  }
  return bytes;
}

std::string pcapng(const std::vector<CapturedFrame>& frames, std::uint16_t link_type) {
  std::string bytes;
  put<std::uint32_t>(bytes, 0x0A0D0D0A);  // section header
  put<std::uint32_t>(bytes, 28);
  put<std::uint32_t>(bytes, 0x1A2B3C4D);
  put<std::uint16_t>(bytes, 1);
  put<std::uint16_t>(bytes, 0);
  put<std::uint64_t>(bytes, 0xFFFFFFFFFFFFFFFF);
  put<std::uint32_t>(bytes, 28);
  put<std::uint32_t>(bytes, 1);  // interface
  put<std::uint32_t>(bytes, 20);
  put(bytes, link_type);
  put<std::uint16_t>(bytes, 0);
  put<std::uint32_t>(bytes, 65535);
  put<std::uint32_t>(bytes, 20);
  for (const CapturedFrame& frame : frames) {
    const std::uint64_t stamp = micros(frame.stamp);
    const auto size = static_cast<std::uint32_t>(frame.bytes.size());
    const std::uint32_t captured = std::min(size, frame.cut);
    const std::uint32_t padded = (captured + 3) / 4 * 4;
    put<std::uint32_t>(bytes, 6);  // enhanced packet
    put<std::uint32_t>(bytes, 32 + padded);
    put<std::uint32_t>(bytes, 0);
    put(bytes, static_cast<std::uint32_t>(stamp >> 32U));
    put(bytes, static_cast<std::uint32_t>(stamp));
    put(bytes, captured);
    put(bytes, size);
    bytes.append(frame.bytes, 0, captured).append(padded - captured, '\0');
    put<std::uint32_t>(bytes, 32 + padded);
  }
  return bytes;
}

std::vector<CapturedFrame> captured(VelodyneSensor sensor, std::size_t packets, double clock_offset,
                                    std::array<std::uint8_t, 4> source) {
  std::vector<CapturedFrame> frames;
  for (std::size_t i = 0; i < packets; ++i) {
    const double seconds = sensor.seconds();
    frames.push_back({.stamp = seconds + clock_offset,
                      .bytes = ethernet(ipv4(udp(to_bytes(sensor.next())), source))});
  }
  return frames;
}

}  // namespace vantage::test
