// `vantage JOB ...` runs `vantage-JOB ...`: the program beside this one, otherwise one on the PATH.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "terminal/style.hpp"
#include "vantage/config_value.hpp"

namespace fs = std::filesystem;

namespace {

constexpr int kUsage = 2;
constexpr std::string_view kPrefix = "vantage-";

bool is_program(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0;
}

std::vector<fs::path> folders() {
  std::vector<fs::path> found;
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (!error) found.push_back(self.parent_path());
  if (const char* path = std::getenv("PATH")) {
    std::istringstream list{std::string(path)};
    for (std::string folder; std::getline(list, folder, ':');) {
      if (!folder.empty()) found.emplace_back(folder);
    }
  }
  return found;
}

/// The name of each job and its program. Of several programs of one name, the first runs.
std::map<std::string, fs::path> programs() {
  std::map<std::string, fs::path> found;
  for (const fs::path& folder : folders()) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      const std::string name = it->path().filename().string();
      if (name.starts_with(kPrefix) && is_program(it->path())) {
        found.emplace(name.substr(kPrefix.size()), it->path());
      }
    }
  }
  return found;
}

std::vector<std::string> jobs() {
  std::vector<std::string> names;
  for (const auto& [name, program] : programs()) names.push_back(name);
  return names;
}

/// What a program says of itself: the first line of its help. Empty if it says nothing.
std::string summary_of(const fs::path& program) {
  std::string command = "'";
  for (const char c : program.string()) command += c == '\'' ? "'\\''" : std::string(1, c);
  command += "' --help 2>/dev/null";
  std::FILE* const help = popen(command.c_str(), "r");
  if (help == nullptr) return {};
  std::string text;
  std::array<char, 4096> part{};
  while (const std::size_t size = std::fread(part.data(), 1, part.size(), help)) {
    text.append(part.data(), size);
  }
  return pclose(help) == 0 ? text.substr(0, text.find('\n')) : std::string();
}

std::string error() { return vantage::cli::Style::of(STDERR_FILENO, "auto").bad("error:") + " "; }

void print_usage(std::ostream& out) {
  out << "usage: vantage JOB [OPTIONS]\n\nLocalization in wide-area point cloud maps with small "
         "observable region maps.\n\njobs:\n";
  const auto found = programs();
  std::size_t width = 0;
  for (const auto& [name, program] : found) width = std::max(width, name.size());
  // Of programs elsewhere on the PATH nothing is known but their names, so none is started.
  const std::vector<fs::path> searched = folders();
  for (const auto& [name, program] : found) {
    const std::string summary =
        program.parent_path() == searched.front() ? summary_of(program) : "";
    out << "  " << name;
    if (!summary.empty()) out << std::string(width - name.size() + 2, ' ') << summary;
    out << '\n';
  }
  out << "\n`vantage JOB --help` explains a job.\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    print_usage(std::cerr);
    return kUsage;
  }
  const std::string job = argv[1];
  if (job == "--help" || job == "-h" || job == "help") {
    print_usage(std::cout);
    return EXIT_SUCCESS;
  }
  if (job == "__complete") {  // what completion_table of apps/common prints for other programs
    for (const std::string& name : jobs())
      std::cout << ".\tcommand\t" << name << "\tnone\tone\t-\n";
    std::cout << ".\tflag\t--help,-h\tnone\tone\tthe jobs\n"
                 ".\tflag\t--version\tnone\tone\tthe version\n";
    return EXIT_SUCCESS;
  }
  if (job == "--version") {
    std::cout << "vantage " << VANTAGE_VERSION << '\n';
    return EXIT_SUCCESS;
  }
  for (const fs::path& folder : folders()) {
    const std::string program = (folder / (std::string(kPrefix) + job)).string();
    if (job.find('/') != std::string::npos || !is_program(program)) continue;
    argv[1] = const_cast<char*>(program.c_str());
    execv(program.c_str(), argv + 1);
    std::cerr << error() << "cannot run " << program << ": " << std::strerror(errno) << '\n';
    return EXIT_FAILURE;
  }
  if (job == "view") {
    std::cerr << error()
              << "no job 'view' here: it is built only where Open3D is installed "
                 "(libopen3d-dev); install that and build again\n";
    return kUsage;
  }
  std::cerr << error() << "no job '" << job << "'" << vantage::did_you_mean(job, jobs())
            << " (`vantage --help` lists them)\n";
  return kUsage;
}
