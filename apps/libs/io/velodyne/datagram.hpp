#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

namespace vantage::io::velodyne {

/// Where a datagram came from.
struct Source {
  std::array<char, 16> address{};  ///< in network order; of IPv4 the first 4 bytes
  bool is_ipv6 = false;
  std::uint16_t port = 0;

  friend bool operator==(const Source&, const Source&) = default;
};

/// "192.168.1.201:2368", "[fe80::1]:2368".
[[nodiscard]] std::string to_string(const Source& source);

struct Datagram {
  Source source;
  std::uint16_t destination_port = 0;
  std::string_view payload;
};

/// Why a frame contains no datagram.
enum class NoDatagram : std::uint8_t {
  other,     ///< a protocol other than UDP over IP, or malformed
  fragment,  ///< part of an IP packet
  cut        ///< the capture contains only its beginning
};

/// Whether captures of that link type can be read: Ethernet, Linux cooked v1 and v2, raw IP and BSD
/// loopback. @param link_type  libpcap's DLT_ number
[[nodiscard]] bool is_known_link(int link_type) noexcept;

/// Takes a captured frame apart (IEEE 802.3, 802.1Q; RFC 791, 8200, 768; LINKTYPE_LINUX_SLL and
/// SLL2 of tcpdump.org). IPv6 extension headers are not followed.
[[nodiscard]] std::variant<Datagram, NoDatagram> udp_datagram(int link_type,
                                                              std::string_view frame) noexcept;

}  // namespace vantage::io::velodyne
