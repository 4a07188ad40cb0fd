#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"

/// Bytes of the engine's own files.
namespace vantage {

/// Appends values as they are in memory.
class ByteWriter {
 public:
  void text(std::string_view text) {
    number(static_cast<std::uint64_t>(text.size()));
    raw(text);
  }
  void raw(std::string_view text) {
    const auto* const begin = reinterpret_cast<const std::byte*>(text.data());
    bytes_.insert(bytes_.end(), begin, begin + text.size());
  }
  template <class Number>
  void number(Number value) {
    std::array<char, sizeof(Number)> as_bytes;
    std::memcpy(as_bytes.data(), &value, sizeof(value));
    raw({as_bytes.data(), as_bytes.size()});
  }
  void numbers(std::span<const double> values) {
    for (const double value : values) number(value);
  }
  void point(const Point& point) { numbers({point.data(), 3}); }
  /// Seven bits a byte, lowest first; the eighth bit says that more follow.
  void counted(std::uint64_t value) {
    for (; value >= 0x80U; value >>= 7U) number(static_cast<std::uint8_t>(value | 0x80U));
    number(static_cast<std::uint8_t>(value));
  }
  void pose(const Pose& pose) {
    numbers({pose.rotation.coeffs().data(), 4});
    numbers({pose.translation.data(), 3});
  }
  [[nodiscard]] std::vector<std::byte> take() && { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

/// Reads what ByteWriter wrote. The first failure stays: everything after it reads as zero.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] bool at_end() const noexcept { return bytes_.empty(); }

  std::string text() { return raw(count(1)); }
  std::string raw(std::size_t length) {
    if (length > bytes_.size()) ok_ = false;
    if (!ok_) return {};
    std::string text(reinterpret_cast<const char*>(bytes_.data()), length);
    bytes_ = bytes_.subspan(length);
    return text;
  }
  /// A number of things that follow, of at least so many bytes each.
  std::size_t count(std::size_t least_bytes) {
    const auto n = number<std::uint64_t>();
    if (n > bytes_.size() / least_bytes) ok_ = false;
    return ok_ ? static_cast<std::size_t>(n) : 0;
  }
  template <class Number>
  Number number() {
    if (sizeof(Number) > bytes_.size()) ok_ = false;
    if (!ok_) return {};
    Number value;
    std::memcpy(&value, bytes_.data(), sizeof(value));
    bytes_ = bytes_.subspan(sizeof(value));
    return value;
  }
  std::uint64_t counted() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64 && ok_; shift += 7) {
      const auto next = std::uint64_t{number<std::uint8_t>()};
      value |= (next & 0x7FU) << shift;
      if (next < 0x80U) return value;
    }
    ok_ = false;
    return 0;
  }
  /// A finite number of at least `least`.
  double real(double least = std::numeric_limits<double>::lowest()) {
    const auto value = number<double>();
    if (!std::isfinite(value) || value < least) ok_ = false;
    return ok_ ? value : 0.0;
  }
  Point point() {
    const double x = real(), y = real(), z = real();
    return {x, y, z};
  }
  Pose pose() {
    Pose pose;
    for (Eigen::Index i = 0; i < 4; ++i) pose.rotation.coeffs()[i] = real();
    pose.translation = point();
    if (ok_ && !is_valid(pose)) ok_ = false;
    return ok_ ? pose : Pose{};
  }
  void check(bool holds) { ok_ = ok_ && holds; }

 private:
  std::span<const std::byte> bytes_;
  bool ok_ = true;
};

}  // namespace vantage
