#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

/// Files of 64-bit words, little endian. The last word is the checksum (XXH64) of all words before.
namespace vantage::io::tiles {

static_assert(std::endian::native == std::endian::little, "words are written as they are");

[[nodiscard]] constexpr std::uint64_t packed(std::int32_t x, std::int32_t y) noexcept {
  return static_cast<std::uint32_t>(x) | static_cast<std::uint64_t>(static_cast<std::uint32_t>(y))
                                             << 32U;
}
[[nodiscard]] constexpr std::int32_t low(std::uint64_t word) noexcept {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(word));
}
[[nodiscard]] constexpr std::int32_t high(std::uint64_t word) noexcept {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(word >> 32U));
}

/// Writes such a file, which appears under its name when it is complete.
class WordWriter {
 public:
  /// Errors: those of OutputFile.
  [[nodiscard]] static Result<WordWriter> create(const std::filesystem::path& path) {
    VANTAGE_TRY(OutputFile file, OutputFile::create(path));
    return WordWriter(std::move(file));
  }

  void put(std::uint64_t word) {
    sum_.add(word);
    append(word);
  }
  void put(double number) { put(std::bit_cast<std::uint64_t>(number)); }

  /// Writes the checksum, and puts the file in place. Errors: those of OutputFile, of any word.
  [[nodiscard]] Result<void> commit() {
    append(sum_.value());
    flush();
    VANTAGE_CHECK(std::move(written_));
    return file_.commit();
  }

 private:
  explicit WordWriter(OutputFile file) noexcept : file_(std::move(file)) {}

  void append(std::uint64_t word) {
    buffer_[used_++] = word;
    if (used_ == buffer_.size()) flush();
  }
  void flush() {
    if (written_) {
      written_ = file_.write({reinterpret_cast<const char*>(buffer_.data()), 8 * used_});
    }
    used_ = 0;
  }

  OutputFile file_;
  Checksum sum_;
  Result<void> written_;
  std::array<std::uint64_t, 512> buffer_{};
  std::size_t used_ = 0;
};

/// Reads such a file.
class WordReader64 {
 public:
  /// Errors: those of InputFile::open; `corrupt_data` for a size that is not in whole words.
  [[nodiscard]] static Result<WordReader64> open(const std::filesystem::path& path,
                                                 std::string_view expected) {
    VANTAGE_TRY(InputFile file, InputFile::open(path, expected));
    if (file.size() % 8 != 0) {
      return fail(ErrorCode::corrupt_data,
                  "the file has " + std::to_string(file.size()) + " bytes, expected " +
                      std::string(expected) + " in words of 8",
                  SourceLocation{path.string(), 0, 0});
    }
    return WordReader64(std::move(file));
  }

  /// The words of the file.
  [[nodiscard]] std::uint64_t size() const noexcept { return file_.size() / 8; }

  /// Errors: `corrupt_data` at the end of the file; `io_failure`.
  [[nodiscard]] Result<std::uint64_t> get() {
    VANTAGE_TRY(const std::uint64_t word, next());
    sum_.add(word);
    return word;
  }

  /// Reads the last word. Errors: `corrupt_data` if it is not the checksum of the others.
  [[nodiscard]] Result<void> finish() {
    VANTAGE_TRY(const std::uint64_t sum, next());
    if (sum == sum_.value() && read_ == size()) return {};
    return error("the checksum does not fit: the file is damaged");
  }

  [[nodiscard]] tl::unexpected<Error> error(std::string message) const {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file_.name(), 0, 0});
  }

 private:
  explicit WordReader64(InputFile file) noexcept : file_(std::move(file)) {}

  [[nodiscard]] Result<std::uint64_t> next() {
    if (at_ == filled_) {
      if (read_ == size()) return error("the file ends at byte " + std::to_string(8 * read_));
      filled_ = static_cast<std::size_t>(std::min<std::uint64_t>(buffer_.size(), size() - read_));
      at_ = 0;
      VANTAGE_CHECK(file_.read(8 * read_, {reinterpret_cast<char*>(buffer_.data()), 8 * filled_}));
    }
    ++read_;
    return buffer_[at_++];
  }

  InputFile file_;
  Checksum sum_;
  std::array<std::uint64_t, 512> buffer_{};
  std::size_t at_ = 0, filled_ = 0;
  std::uint64_t read_ = 0;
};

}  // namespace vantage::io::tiles
