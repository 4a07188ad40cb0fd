#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace vantage::io::ros {

enum class Compression : std::uint8_t { none, bz2, lz4, zstd };

/// The largest size of a chunk or a message [bytes], before and after decompression.
inline constexpr std::uint64_t kLargestChunk = std::uint64_t{1} << 30;

/// The most that this many bytes may give when they are decompressed [bytes]. Recordings shrink to
/// a tenth or a hundredth, but a few hundred bytes of bz2 can give a gigabyte.
[[nodiscard]] constexpr std::uint64_t largest_content(std::uint64_t packed) noexcept {
  constexpr std::uint64_t kAlways = std::uint64_t{64} << 20, kExpansion = 1024;
  return std::clamp(kExpansion * std::min(packed, kLargestChunk), kAlways, kLargestChunk);
}

/// The most that all chunks or messages of a file may give in one pass over the file [bytes].
[[nodiscard]] constexpr std::uint64_t largest_total(std::uint64_t file) noexcept {
  constexpr std::uint64_t kAlways = std::uint64_t{256} << 20, kLargestFile = std::uint64_t{1} << 52;
  return kAlways + 1024 * std::min(file, kLargestFile);
}

inline constexpr std::string_view kZstdMagic = "\x28\xB5\x2F\xFD";

/// Memory that is used repeatedly; bytes that are added have no value yet.
class Buffer {
 public:
  /// Makes room for `size` bytes and keeps the values of the first `kept`; false if memory is
  /// short.
  [[nodiscard]] bool make_room(std::size_t size, std::size_t kept);
  [[nodiscard]] std::span<char> span(std::size_t size) noexcept { return {bytes_.get(), size}; }
  [[nodiscard]] std::string_view view(std::size_t size) const noexcept {
    return {bytes_.get(), size};
  }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }

 private:
  std::unique_ptr<char[]> bytes_;
  std::size_t capacity_ = 0;
};

struct Decompressed {
  std::size_t size = 0;  ///< bytes at the beginning of the buffer, even if there was a problem
  std::string problem;   ///< "the bz2 stream is damaged at byte 17"; empty if there was no problem
};

/// Decompresses bz2, frames of LZ4 or frames of zstd. Memory grows only with the data that really
/// comes.
/// Precondition: compression is not `none`; input.size() <= kLargestChunk.
/// @param largest  more output is a problem [bytes], as is more than largest_content(input.size())
[[nodiscard]] Decompressed decompress(Compression compression, std::string_view input,
                                      std::uint64_t largest, Buffer& output);

}  // namespace vantage::io::ros
