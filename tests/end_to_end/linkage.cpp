// What is linked to what: promises that only the finished files can keep or break.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <set>
#include <sstream>
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

/// The names that nm prints for a file, as the linker knows them.
std::set<std::string> symbols_of(const std::string& options, const fs::path& file) {
  std::istringstream lines(output_of("nm --format=posix " + options + " '" + file.string() + "'"));
  std::set<std::string> names;
  for (std::string line; std::getline(lines, line);) {
    names.insert(line.substr(0, line.find_first_of(" @")));
  }
  return names;
}

fs::path library(const std::string& name) {
  return fs::path(VANTAGE_PLUGIN_DIR).parent_path() / name;
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
  std::erase_if(files, [](const fs::path& file) {
    return file.filename() == "vantage_visibility_hpr_open3d.so";
  });
  files.push_back(fs::path(VANTAGE_PROGRAM_DIR) / "vantage-localize");
  for (const fs::path& file : files) {
    const std::string libraries = output_of("ldd '" + file.string() + "'");
    REQUIRE(libraries.find("libvantage_core") != std::string::npos);
    CHECK_MESSAGE(libraries.find("Open3D") == std::string::npos, file.string());
    CHECK_MESSAGE(libraries.find("libpcl") == std::string::npos, file.string());
    CHECK_MESSAGE(libraries.find("not found") == std::string::npos, libraries);
  }
}

TEST_CASE("what a robot installs links no build") {
  // The programs of the package vantage-robot.
  for (const char* program : {"vantage", "vantage-localize", "vantage-live", "vantage-info"}) {
    const fs::path file = fs::path(VANTAGE_PROGRAM_DIR) / program;
    const std::string libraries = output_of("ldd '" + file.string() + "'");
    REQUIRE(libraries.find("libc.so") != std::string::npos);
    CHECK_MESSAGE(libraries.find("libvantage_build") == std::string::npos, libraries);
  }
}

TEST_CASE("a plugin has nothing of the engine, of toml++ or of Boost, linked or compiled in") {
  const std::set<std::string> of_core =
      symbols_of("-D --defined-only", library("libvantage_core.so"));
  std::set<std::string> of_engine =
      symbols_of("-D --defined-only", library("libvantage_engine.so"));
  REQUIRE(of_core.size() > 50);
  // Both also export what they made of the standard library's templates.
  std::erase_if(of_engine, [&](const std::string& name) {
    return of_core.contains(name) || name.find("7vantage") == std::string::npos;
  });
  REQUIRE(of_engine.size() > 50);
  for (const fs::path& file : plugins()) {
    CAPTURE(file.string());
    const std::string libraries = output_of("ldd '" + file.string() + "'");
    REQUIRE(libraries.find("libvantage_core") != std::string::npos);
    for (const char* other :
         {"libvantage_engine", "libvantage_build", "libboost", "libtoml", "tomlplusplus"}) {
      CHECK_MESSAGE(libraries.find(other) == std::string::npos, libraries);
    }
    const std::set<std::string> symbols = symbols_of("", file);
    REQUIRE(symbols.contains("vantage_plugin"));
    std::vector<std::string> foreign;
    std::set_intersection(symbols.begin(), symbols.end(), of_engine.begin(), of_engine.end(),
                          std::back_inserter(foreign));
    for (const std::string& name : symbols) {
      // Mangled: a namespace is its name behind the number of its letters.
      if (name.find("4toml") != std::string::npos || name.find("5boost") != std::string::npos) {
        foreign.push_back(name);
      }
    }
    CHECK_MESSAGE(foreign.empty(), foreign.size() << " of " << symbols.size() << " symbols, first "
                                                  << (foreign.empty() ? "" : foreign.front()));
  }
}
