#pragma once

#include <doctest/doctest.h>
#include <array>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>

#include "support/real_data.hpp"
#include "vantage/io/point_cloud_io.hpp"

namespace vantage::test {

inline std::filesystem::path put(const std::filesystem::path& path, std::string_view content) {
  std::ofstream out(path, std::ios::binary);
  out.write(content.data(), static_cast<std::streamsize>(content.size()));
  REQUIRE(out.flush().good());
  return path;
}

inline std::string content_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  REQUIRE(in.good());
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The bytes of a value, in the machine's order or reversed.
template <class T>
std::string raw(T value) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof(T));
  return {bytes.data(), bytes.size()};
}
template <class T>
std::string reversed(T value) {
  const std::string bytes = raw(value);
  return {bytes.rbegin(), bytes.rend()};
}

/// Reads a file of that content and name in a folder of its own.
inline Result<io::LoadedCloud> read_as(const std::string& name, std::string_view content) {
  const TemporaryFolder folder;
  return io::read_point_cloud(put(folder.path() / name, content));
}

/// Checks that an error is one line that names the file and holds `expected`.
inline void check_clear(const Error& error, ErrorCode code, const std::string& file,
                        const std::string& expected) {
  const std::string line = to_string(error);
  CAPTURE(line);
  CHECK(to_string(error.code) == std::string(to_string(code)));
  CHECK(line.find('\n') == std::string::npos);
  CHECK(line.find(file) != std::string::npos);
  CHECK(line.find(expected) != std::string::npos);
  CHECK(line.size() < 400);
}

/// Checks that read_as fails with `corrupt_data` and that text in its line.
inline void check_refused(const std::string& name, std::string_view content,
                          const std::string& expected) {
  CAPTURE(content.substr(0, 400));
  const auto cloud = read_as(name, content);
  REQUIRE_FALSE(cloud.has_value());
  check_clear(cloud.error(), ErrorCode::corrupt_data, name, expected);
}

/// Puts random bytes into `places` random places of a file's content, so many times: points or an
/// error of one line, never a crash. @return  how often it is refused
inline int check_damaged(const std::string& name, const std::string& good, int rounds, int places,
                         std::mt19937& random) {
  int refused = 0;
  for (int i = 0; i < rounds; ++i) {
    std::string content = good;
    for (int k = 0; k < places; ++k) {
      content[random() % content.size()] = static_cast<char>(random());
    }
    const auto cloud = read_as(name, content);
    if (cloud) continue;
    ++refused;
    CHECK(to_string(cloud.error()).find('\n') == std::string::npos);
  }
  return refused;
}

}  // namespace vantage::test
