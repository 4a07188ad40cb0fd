#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"

/// Values in bytes: little endian, one after the other. A record is said once for writing and
/// reading, by a template that goes through its parts: a ByteWriter takes them, a ByteReader puts
/// them in.
///
///     template <class Archive, class T>  // T is const for a writer
///     void describe(Archive& archive, T& place) {
///       archive.field(place.position);
///       archive.field(place.likeness);
///       archive.check(place.likeness > 0.0);  // only a reader checks
///     }
namespace vantage {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

class ByteWriter {
 public:
  /// @param expected  about how many bytes will come
  explicit ByteWriter(std::size_t expected = 0) { bytes_.reserve(expected); }

  void raw(std::span<const std::byte> bytes) {
    const std::size_t before = bytes_.size();
    bytes_.resize(before + bytes.size());
    if (!bytes.empty()) std::memcpy(bytes_.data() + before, bytes.data(), bytes.size());
  }
  void raw(std::string_view text) { raw(std::as_bytes(std::span(text))); }
  /// Its length, and the text.
  void text(std::string_view text) {
    number(std::uint64_t{text.size()});
    raw(text);
  }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void number(const T& value) { raw(std::as_bytes(std::span(&value, 1))); }
  void numbers(std::span<const double> values) { raw(std::as_bytes(values)); }
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

  static constexpr bool kReads = false;
  template <class T>
  void field(const T& value) {
    number(value);
  }
  void field(double value, double /*least*/) { number(value); }
  void field(const std::string& value) { text(value); }
  void field(const std::vector<std::byte>& value) {
    number(std::uint64_t{value.size()});
    raw(value);
  }
  void field(const Point& value) { point(value); }
  void field(const Pose& value) { pose(value); }
  template <class List, class Visit>
  void list(const List& list, std::size_t /*least_bytes*/, const Visit& visit) {
    number(std::uint64_t{list.size()});
    for (const auto& one : list) visit(one);
  }
  void check(bool /*holds*/) const noexcept {}
  [[nodiscard]] bool ok() const noexcept { return true; }

  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::vector<std::byte> take() && { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

/// Takes values from the front of bytes, which are borrowed. After the first that is not there, it
/// is not `ok` any more, and everything is 0 or empty.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) noexcept : bytes_(bytes) {}
  explicit ByteReader(std::span<const std::byte> bytes) noexcept
      : bytes_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t left() const noexcept { return ok_ ? bytes_.size() - at_ : 0; }
  /// Of the next byte.
  [[nodiscard]] std::size_t offset() const noexcept { return at_; }
  void check(bool holds) noexcept { ok_ = ok_ && holds; }

  [[nodiscard]] std::string_view raw(std::uint64_t size) noexcept {
    check(size <= left());
    if (!ok_) return {};
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }
  [[nodiscard]] std::span<const std::byte> bytes(std::uint64_t size) noexcept {
    return std::as_bytes(std::span(raw(size)));
  }
  /// A text behind its length.
  template <class Length = std::uint64_t>
  [[nodiscard]] std::string_view text() noexcept {
    return raw(number<Length>());
  }
  /// A number of things that follow, of at least so many bytes each.
  [[nodiscard]] std::size_t count(std::size_t least_bytes) noexcept {
    const auto n = number<std::uint64_t>();
    check(n <= left() / least_bytes);
    return ok_ ? static_cast<std::size_t>(n) : 0;
  }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  [[nodiscard]] T number() noexcept {
    T value{};
    const std::string_view taken = raw(sizeof value);
    if (ok_) std::memcpy(&value, taken.data(), sizeof value);
    return value;
  }
  /// See ByteWriter::counted.
  [[nodiscard]] std::uint64_t counted() noexcept {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64 && ok_; shift += 7) {
      const auto next = std::uint64_t{number<std::uint8_t>()};
      value |= (next & 0x7FU) << shift;
      if (next < 0x80U) return ok_ ? value : 0;
    }
    ok_ = false;
    return 0;
  }
  /// A finite number of at least `least`.
  [[nodiscard]] double real(double least = std::numeric_limits<double>::lowest()) noexcept {
    const auto value = number<double>();
    check(std::isfinite(value) && value >= least);
    return ok_ ? value : 0.0;
  }
  [[nodiscard]] Point point() noexcept {
    const double x = real(), y = real(), z = real();
    return {x, y, z};
  }
  [[nodiscard]] Pose pose() noexcept {
    Pose pose;
    for (Eigen::Index i = 0; i < 4; ++i) pose.rotation.coeffs()[i] = real();
    pose.translation = point();
    check(is_valid(pose));
    return ok_ ? pose : Pose{};
  }

  static constexpr bool kReads = true;
  template <class T>
  void field(T& value) noexcept {
    value = number<T>();
  }
  /// A finite number of at least `least`.
  void field(double& value, double least) noexcept { value = real(least); }
  void field(std::string& value) { value = text(); }
  void field(std::vector<std::byte>& value) {
    const auto taken = bytes(count(1));
    value.assign(taken.begin(), taken.end());
  }
  void field(Point& value) noexcept { value = point(); }
  void field(Pose& value) noexcept { value = pose(); }
  template <class T>
  void counted(T& value) noexcept {
    value = static_cast<T>(counted());
  }
  /// Elements of at least so many bytes each.
  template <class List, class Visit>
  void list(List& list, std::size_t least_bytes, const Visit& visit) {
    for (std::size_t left = count(least_bytes); left > 0 && ok_; --left) visit(list.emplace_back());
  }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace vantage
