#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "vantage/kit/byte_io.hpp"
#include "vantage/result.hpp"

// What the formats of prepared maps share: bytes that are little endian on all machines, and
// numbers of a few bits.
namespace vantage::matching {

/// Every step is a bijection of the sum, so a change within eight bytes is always detected.
[[nodiscard]] std::uint64_t checksum_of(std::span<const std::byte> bytes) noexcept;

/// Numbers of at most 16 bits, one after the other, the lowest bit first.
class BitWriter {
 public:
  void number(std::uint32_t value, unsigned bits) {
    waiting_ |= (value & ((1U << bits) - 1U)) << held_;
    for (held_ += bits; held_ >= 8; held_ -= 8, waiting_ >>= 8U) push();
  }
  /// The last byte is filled up with zeros.
  [[nodiscard]] std::vector<std::byte> finish() && {
    if (held_ > 0) push();
    return std::move(bytes_);
  }

 private:
  void push() { bytes_.push_back(std::byte(waiting_ & 0xFFU)); }
  std::vector<std::byte> bytes_;
  std::uint32_t waiting_ = 0;  // fewer than 8 bits between two numbers
  unsigned held_ = 0;          // how many
};

/// Precondition: no more bits are read than there are.
class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] std::uint32_t number(unsigned bits) {
    for (; held_ < bits; held_ += 8) {
      waiting_ |= std::to_integer<std::uint32_t>(bytes_[at_++]) << held_;
    }
    const std::uint32_t value = waiting_ & ((1U << bits) - 1U);
    waiting_ >>= bits;
    held_ -= bits;
    return value;
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::uint32_t waiting_ = 0;  // bits that were read with those of a number before
  unsigned held_ = 0;          // how many
};

/// A format of prepared maps. All begin with four letters, version and form, and end with a
/// checksum.
struct StoredFormat {
  std::array<char, 4> letters;
  std::uint16_t version;
  std::size_t header;  ///< bytes
  const char* name;    ///< for messages: "NDT map"

  static constexpr std::size_t kChecksum = 8;

  /// @param size  about how many bytes follow the header
  [[nodiscard]] ByteWriter begun(std::uint16_t form, std::size_t size) const;
  /// All bytes, and their checksum.
  [[nodiscard]] static std::vector<std::byte> finished(ByteWriter out) {
    out.number(checksum_of(out.bytes()));
    return std::move(out).take();
  }
  /// @return  a reader of the bytes between form and checksum; and the form
  /// Errors: `corrupt_data` for other bytes, or a form that is greater than `last_form`.
  [[nodiscard]] Result<std::pair<ByteReader, std::uint16_t>> opened(
      std::span<const std::byte> bytes, std::uint16_t last_form) const;
  [[nodiscard]] auto corrupt(const std::string& why) const {
    return fail(ErrorCode::corrupt_data, std::string("the stored ") + name + " is damaged: " + why);
  }
};

}  // namespace vantage::matching
