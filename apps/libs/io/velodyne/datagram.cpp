#include "io/velodyne/datagram.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <pcap/dlt.h>

#include <algorithm>
#include <cstddef>
#include <optional>

namespace vantage::io::velodyne {
namespace {

constexpr std::uint8_t kUdp = 17;
constexpr std::size_t kUdpHeader = 8;

std::uint8_t byte_at(std::string_view bytes, std::size_t i) noexcept {
  return static_cast<std::uint8_t>(bytes[i]);
}
/// In network order.
std::uint16_t word_at(std::string_view bytes, std::size_t i) noexcept {
  return static_cast<std::uint16_t>(byte_at(bytes, i) << 8U | byte_at(bytes, i + 1));
}

/// What follows the link header and its VLAN tags, if it is IP.
/// @param type  where the link header holds the protocol; its end is `header`
std::optional<std::string_view> after_tags(std::string_view frame, std::size_t type,
                                           std::size_t header) noexcept {
  if (frame.size() < header) return std::nullopt;
  std::uint16_t protocol = word_at(frame, type);
  frame.remove_prefix(header);
  while (protocol == 0x8100 || protocol == 0x88A8 || protocol == 0x9100) {
    if (frame.size() < 4) return std::nullopt;
    protocol = word_at(frame, 2);
    frame.remove_prefix(4);
  }
  if (protocol != 0x0800 && protocol != 0x86DD) return std::nullopt;
  return frame;
}

std::optional<std::string_view> ip_packet(int link_type, std::string_view frame) noexcept {
  switch (link_type) {
    case DLT_EN10MB: return after_tags(frame, 12, 14);
    case DLT_LINUX_SLL: return after_tags(frame, 14, 16);
    case DLT_LINUX_SLL2: return after_tags(frame, 0, 20);
    case DLT_NULL:
    case DLT_LOOP:  // 4 bytes of address family; the version of IP says the same
      if (frame.size() < 4) return std::nullopt;
      return frame.substr(4);
    default: return frame;
  }
}

std::variant<Datagram, NoDatagram> parse_udp(std::string_view bytes, Source source) noexcept {
  if (bytes.size() < kUdpHeader) return NoDatagram::cut;
  const std::size_t length = word_at(bytes, 4);
  if (length < kUdpHeader) return NoDatagram::other;
  if (length > bytes.size()) return NoDatagram::cut;
  source.port = word_at(bytes, 0);
  return Datagram{.source = source,
                  .destination_port = word_at(bytes, 2),
                  .payload = bytes.substr(kUdpHeader, length - kUdpHeader)};
}

std::variant<Datagram, NoDatagram> parse_ipv4(std::string_view ip) noexcept {
  if (ip.size() < 20) return NoDatagram::cut;
  const std::size_t header = static_cast<std::size_t>(byte_at(ip, 0) & 0x0FU) * 4;
  const std::size_t length = word_at(ip, 2);
  if (header < 20 || length < header || byte_at(ip, 9) != kUdp) return NoDatagram::other;
  // There are more fragments, or this is not the first one.
  if ((word_at(ip, 6) & 0x3FFFU) != 0) return NoDatagram::fragment;
  if (ip.size() < header) return NoDatagram::cut;
  Source source;
  std::copy_n(ip.begin() + 12, 4, source.address.begin());
  // Short frames are padded: bytes beyond the length do not belong to the packet.
  return parse_udp(ip.substr(0, length).substr(header), source);
}

std::variant<Datagram, NoDatagram> parse_ipv6(std::string_view ip) noexcept {
  constexpr std::size_t kHeader = 40;
  constexpr std::uint8_t kFragment = 44;
  if (ip.size() < kHeader) return NoDatagram::cut;
  if (byte_at(ip, 6) == kFragment) return NoDatagram::fragment;
  if (byte_at(ip, 6) != kUdp) return NoDatagram::other;
  Source source;
  source.is_ipv6 = true;
  std::copy_n(ip.begin() + 8, 16, source.address.begin());
  return parse_udp(ip.substr(kHeader).substr(0, word_at(ip, 4)), source);
}

}  // namespace

std::string to_string(const Source& source) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  ::inet_ntop(source.is_ipv6 ? AF_INET6 : AF_INET, source.address.data(), text.data(), text.size());
  return fmt::format(fmt::runtime(source.is_ipv6 ? "[{}]:{}" : "{}:{}"), text.data(), source.port);
}

bool is_known_link(int link_type) noexcept {
  return link_type == DLT_EN10MB || link_type == DLT_LINUX_SLL || link_type == DLT_LINUX_SLL2 ||
         link_type == DLT_NULL || link_type == DLT_LOOP || link_type == DLT_RAW ||
         link_type == DLT_IPV4 || link_type == DLT_IPV6;
}

std::variant<Datagram, NoDatagram> udp_datagram(int link_type, std::string_view frame) noexcept {
  const auto ip = ip_packet(link_type, frame);
  if (!ip || ip->empty()) return NoDatagram::other;
  switch (byte_at(*ip, 0) >> 4U) {
    case 4: return parse_ipv4(*ip);
    case 6: return parse_ipv6(*ip);
    default: return NoDatagram::other;
  }
}

}  // namespace vantage::io::velodyne
