#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vantage {

/// How likely the next bit of a kind is set. It learns from each bit that is coded with it.
/// Integers only: all machines learn the same.
class Chance {
 public:
  /// In 65536ths; at least 1, at most 65535.
  [[nodiscard]] std::uint32_t set() const noexcept { return set_; }
  void learn(bool bit) noexcept {
    set_ = bit ? set_ + ((65536U - set_) >> shift_) : set_ - (set_ >> shift_);
    if (shift_ < 5U) ++shift_;
  }

 private:
  std::uint32_t set_ = 32768;
  std::uint32_t shift_ = 1;  // the first bits teach the most
};

/// The numbers that the bits so far leave to the rest of the bytes, as their first 32 bits.
/// Each bit splits them in two, as large as the bit's chances (binary arithmetic coding).
class CodeRange {
 public:
  /// The last number of a set bit.
  [[nodiscard]] std::uint32_t split(const Chance& chance) const noexcept {
    return low_ + std::uint32_t(std::uint64_t(high_ - low_) * chance.set() >> 16U);
  }
  void keep(bool bit, std::uint32_t split) noexcept { (bit ? high_ : low_) = split + !bit; }
  [[nodiscard]] std::uint32_t low() const noexcept { return low_; }
  /// All numbers begin with the same byte.
  [[nodiscard]] bool first_byte_is_known() const noexcept { return ((low_ ^ high_) >> 24U) == 0; }
  std::byte take_first_byte() noexcept {
    const auto byte = std::byte(low_ >> 24U);
    low_ <<= 8U;
    high_ = high_ << 8U | 255U;
    return byte;
  }

 private:
  std::uint32_t low_ = 0, high_ = ~std::uint32_t{0};
};

/// Writes bits; the likelier a bit was, the less room it takes.
class BitEncoder {
 public:
  bool code(Chance& chance, bool bit) {
    range_.keep(bit, range_.split(chance));
    chance.learn(bit);
    while (range_.first_byte_is_known()) bytes_.push_back(range_.take_first_byte());
    return bit;
  }
  /// As a decoder's: encoding and decoding are written as the same steps.
  [[nodiscard]] static constexpr bool is_cut_off() noexcept { return false; }
  /// The lowest number that is left stands for all bits.
  [[nodiscard]] std::vector<std::byte> finish() && {
    for (int i = 0; i < 4; ++i) bytes_.push_back(range_.take_first_byte());
    return std::move(bytes_);
  }

 private:
  CodeRange range_;
  std::vector<std::byte> bytes_;
};

/// Reads the bits that a BitEncoder wrote with the same chances. Other bytes give other bits.
class BitDecoder {
 public:
  explicit BitDecoder(std::span<const std::byte> bytes) : rest_(bytes) {
    for (int i = 0; i < 4; ++i) read_byte();
  }
  /// Ignores its second argument: encoding and decoding are written as the same steps.
  bool code(Chance& chance, bool /*bit*/) noexcept {
    const std::uint32_t split = range_.split(chance);
    const bool bit = number_ <= split;
    range_.keep(bit, split);
    chance.learn(bit);
    while (range_.first_byte_is_known()) {
      range_.take_first_byte();
      read_byte();
    }
    return bit;
  }
  /// Bits were read that the bytes do not hold.
  [[nodiscard]] bool is_cut_off() const noexcept { return cut_off_; }
  /// After the last bit: the bytes end here, as BitEncoder ends them.
  [[nodiscard]] bool is_at_end() const noexcept {
    return rest_.empty() && !cut_off_ && number_ == range_.low();
  }

 private:
  void read_byte() noexcept {
    number_ <<= 8U;
    cut_off_ = cut_off_ || rest_.empty();
    if (rest_.empty()) return;
    number_ |= std::to_integer<std::uint32_t>(rest_.front());
    rest_ = rest_.subspan(1);
  }

  CodeRange range_;
  std::span<const std::byte> rest_;
  std::uint32_t number_ = 0;
  bool cut_off_ = false;
};

}  // namespace vantage
