#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace vantage {

/// XXH64 (Collet), with seed 0. Bytes that are added piece by piece have the sum of the whole. The
/// same bytes have the same sum on every machine: `xxhsum -H1` prints it.
class Checksum {
 public:
  Checksum() noexcept;
  void add(std::string_view bytes) noexcept;
  void add(std::span<const std::byte> bytes) noexcept;
  /// Adds the eight bytes of a number, the lowest first.
  void add(std::uint64_t number) noexcept;
  [[nodiscard]] std::uint64_t value() const noexcept;

 private:
  alignas(std::uint64_t) std::array<std::byte, 88> state_;  // of xxHash
};

/// The checksum of bytes that are there as a whole.
[[nodiscard]] std::uint64_t checksum_of(std::string_view bytes) noexcept;
[[nodiscard]] std::uint64_t checksum_of(std::span<const std::byte> bytes) noexcept;

}  // namespace vantage
