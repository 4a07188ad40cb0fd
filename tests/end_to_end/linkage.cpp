// What is linked to what: promises that only the finished files can keep or break.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace fs = std::filesystem;

namespace {

std::string output_of(const std::string& command) {
  std::string text;
  const auto close = [](std::FILE* pipe) { pclose(pipe); };
  const std::unique_ptr<std::FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
  REQUIRE(pipe);
  std::array<char, 4096> buffer{};
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe.get())) {
    text.append(buffer.data(), n);
  }
  return text;
}

std::vector<fs::path> plugins() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(VANTAGE_PLUGIN_DIR)) {
    if (entry.path().extension() == ".so") files.push_back(entry.path());
  }
  return files;
}

}  // namespace

TEST_CASE("every plugin exports one symbol, strong, and nothing else") {
  const auto files = plugins();
  REQUIRE(files.size() >= 7);
  for (const fs::path& file : files) {
    const std::string symbols = output_of("nm -D --defined-only '" + file.string() + "'");
    CHECK_MESSAGE(std::count(symbols.begin(), symbols.end(), '\n') == 1, file.string() << '\n'
                                                                                       << symbols);
    CHECK(symbols.ends_with(" D vantage_plugin\n"));
  }
}

TEST_CASE("nothing that localize loads links Open3D or PCL") {
  std::vector<fs::path> files = plugins();
  // The reference operator, which is for comparison and tests only and not installed.
  CHECK(std::erase_if(files, [](const fs::path& file) {
          return file.filename() == "vantage_visibility_hpr_open3d.so";
        }) == 1);
  files.push_back(fs::path(VANTAGE_PROGRAM_DIR) / "vantage-localize");
  for (const fs::path& file : files) {
    const std::string libraries = output_of("ldd '" + file.string() + "'");
    REQUIRE(libraries.find("libvantage_core") != std::string::npos);
    CHECK_MESSAGE(libraries.find("Open3D") == std::string::npos, file.string());
    CHECK_MESSAGE(libraries.find("libpcl") == std::string::npos, file.string());
    CHECK_MESSAGE(libraries.find("not found") == std::string::npos, libraries);
  }
}
