#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "vantage/result.hpp"

// What the formats of prepared maps share: bytes that are little endian on all machines, and
// numbers of a few bits.
namespace vantage::matching {

/// Every step is a bijection of the sum, so a change within eight bytes is always detected.
[[nodiscard]] std::uint64_t checksum_of(std::span<const std::byte> bytes) noexcept;

class ByteWriter {
 public:
  explicit ByteWriter(std::size_t expected) { bytes_.reserve(expected); }

  template <std::integral T>
  void integer(T value) {
    auto bits = static_cast<std::uint64_t>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i, bits >>= 8U) byte(bits & 0xFFU);
  }
  void real(double value) { integer(std::bit_cast<std::uint64_t>(value)); }
  /// Seven bits per byte, lowest first; the eighth bit says that more follow.
  void counted(std::uint64_t value) {
    for (; value >= 0x80U; value >>= 7U) byte((value & 0x7FU) | 0x80U);
    byte(value);
  }
  void bytes(std::span<const std::byte> some) {
    bytes_.insert(bytes_.end(), some.begin(), some.end());
  }
  /// All bytes, and their checksum.
  [[nodiscard]] std::vector<std::byte> finish() && {
    integer(checksum_of(bytes_));
    return std::move(bytes_);
  }

 private:
  void byte(std::uint64_t value) { bytes_.push_back(static_cast<std::byte>(value)); }
  std::vector<std::byte> bytes_;
};

/// Reads what ByteWriter wrote. Past the end, it reads zeros and remembers that it did.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <std::integral T>
  [[nodiscard]] T integer() {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) bits |= byte() << (8 * i);
    return static_cast<T>(bits);
  }
  [[nodiscard]] double real() { return std::bit_cast<double>(integer<std::uint64_t>()); }
  [[nodiscard]] std::uint64_t counted() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint64_t next = byte();
      value |= (next & 0x7FU) << shift;
      if (next < 0x80U) return value;
    }
    good_ = false;
    return 0;
  }
  /// So many bytes, or none if there are fewer.
  [[nodiscard]] std::span<const std::byte> bytes(std::size_t count) {
    good_ = good_ && count <= left();
    if (!good_) return {};
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - at_; }
  [[nodiscard]] bool good() const noexcept { return good_; }

 private:
  [[nodiscard]] std::uint64_t byte() {
    if (at_ < bytes_.size()) return std::to_integer<std::uint64_t>(bytes_[at_++]);
    good_ = false;
    return 0;
  }
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool good_ = true;
};

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
  /// @return  a reader of the bytes between form and checksum; and the form
  /// Errors: `corrupt_data` for other bytes, or a form that is greater than `last_form`.
  [[nodiscard]] Result<std::pair<ByteReader, std::uint16_t>> opened(
      std::span<const std::byte> bytes, std::uint16_t last_form) const;
  [[nodiscard]] auto corrupt(const std::string& why) const {
    return fail(ErrorCode::corrupt_data, std::string("the stored ") + name + " is damaged: " + why);
  }
};

}  // namespace vantage::matching
