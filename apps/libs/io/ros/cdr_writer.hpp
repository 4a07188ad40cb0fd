#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "io/ros/little_endian.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// Writes one message in the layout of ROS 2: plain CDR, little endian (OMG CORBA 3.0 15.3; the
/// 4-byte header is that of DDSI-RTPS 10.2). Numbers are aligned to their size, counted from the
/// end of the header.
class CdrWriter {
 public:
  template <class T>
  void number(T value) {
    const std::size_t body = bytes_.size() - kHeaderSize;
    bytes_.resize(kHeaderSize + (body + sizeof(T) - 1) / sizeof(T) * sizeof(T));
    append_little_endian(bytes_, value);
  }
  /// Writes the number of elements that follow in a sequence.
  void count(std::size_t elements) {
    too_large_ = too_large_ || elements > std::numeric_limits<std::uint32_t>::max();
    number(static_cast<std::uint32_t>(elements));
  }
  void text(std::string_view text) {
    count(text.size() + 1);
    bytes_ += text;
    bytes_ += '\0';
  }
  /// Writes bytes unchanged, for the elements of a byte array.
  void raw(std::string_view bytes) { bytes_ += bytes; }

  /// The message. Errors: `invalid_input` if a count did not fit into 32 bits.
  [[nodiscard]] Result<std::string> finish() && {
    if (too_large_) {
      return fail(ErrorCode::invalid_input, "a message of 2^32 bytes or more cannot be written");
    }
    return std::move(bytes_);
  }

 private:
  static constexpr std::size_t kHeaderSize = 4;
  std::string bytes_{0, 1, 0, 0};
  bool too_large_ = false;
};

}  // namespace vantage::io::ros
