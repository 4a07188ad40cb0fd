#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>

#include "io/point_fields.hpp"
#include "io/ros/message_reader.hpp"
#include "io/ros/messages.hpp"
#include "io/ros/ros_time.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// Takes the bytes of a message apart, member by member, in either encoding:
/// - ROS 1 (wiki.ros.org/msg, "Fields"): little endian, packed; a string is a length and that many
///   bytes
/// - plain CDR (DDS-XTypes 1.3, 7.4.1; encapsulation: RTPS 2.5, 10.2): a 4-byte header, then
///   members at multiples of their size after it; the length of a string includes its final zero
/// `what` names a member in errors, which are `corrupt_data` with the byte in the message.
/// The bytes and `where` must outlive the reader.
class WireReader {
 public:
  /// Errors: a missing header, or a header that is not that of plain CDR.
  [[nodiscard]] static Result<WireReader> open(std::string_view bytes, Encoding encoding,
                                               const SourceLocation& where);

  template <class Number>
  [[nodiscard]] Result<Number> number(std::string_view what) {
    VANTAGE_CHECK(align(sizeof(Number), what));
    VANTAGE_TRY(const auto stored, bytes(sizeof(Number), what));
    std::array<char, sizeof(Number)> raw;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      raw[i] = stored[order_ == ByteOrder::little ? i : raw.size() - 1 - i];
    }
    return std::bit_cast<Number>(raw);
  }
  [[nodiscard]] Result<std::string_view> bytes(std::size_t count, std::string_view what);
  [[nodiscard]] Result<std::string_view> text(std::string_view what);
  /// The length of an array whose elements take at least `smallest` bytes each.
  [[nodiscard]] Result<std::size_t> count(std::size_t smallest, std::string_view what);
  [[nodiscard]] Result<Stamp> time(std::string_view what);
  [[nodiscard]] Result<Header> header();

  [[nodiscard]] ByteOrder order() const noexcept { return order_; }
  /// The place of the next member, before alignment.
  [[nodiscard]] std::size_t offset() const noexcept { return offset_; }
  [[nodiscard]] tl::unexpected<Error> error(std::string message) const;

 private:
  WireReader(std::string_view bytes, Encoding encoding, const SourceLocation& where) noexcept
      : bytes_(bytes), encoding_(encoding), where_(&where) {}
  [[nodiscard]] Result<void> align(std::size_t size, std::string_view what);
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - offset_; }
  [[nodiscard]] tl::unexpected<Error> ends(std::size_t needed, std::string_view what) const;

  std::string_view bytes_;
  Encoding encoding_;
  const SourceLocation* where_;
  ByteOrder order_ = ByteOrder::little;
  std::size_t offset_ = 0;
};

}  // namespace vantage::io::ros
