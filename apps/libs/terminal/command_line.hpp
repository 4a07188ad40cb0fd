#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "terminal/style.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::cli {

inline constexpr int kFailed = 1;
inline constexpr int kUsage = 2;

/// The options of every program that takes a configuration file.
struct CommonOptions {
  std::vector<std::string> overrides;              ///< --set key.path=value
  std::vector<std::filesystem::path> plugin_dirs;  ///< --plugin-dir
  std::size_t jobs = 0;                            ///< --jobs; 0 = all cores
  bool quiet = false;                              ///< --quiet: no progress
  bool json = false;                               ///< --json: results as JSON
  std::string color = "auto";                      ///< --color, see add_color_option

  void add_to(CLI::App& app);
  /// The style of standard output.
  [[nodiscard]] Style style() const;
  [[nodiscard]] PluginLoader loader() const {
    return PluginLoader::with_default_folders(plugin_dirs);
  }
};

/// Adds `--plugin-dir DIR`, which may be given several times.
void add_plugin_folders_option(
    CLI::App& app, std::vector<std::filesystem::path>& folders,
    const std::string& description =
        "look for plugins here first (then $VANTAGE_PLUGIN_PATH, then beside the library)");

/// Adds `--color auto|always|never`. run_program finds the option by its name, to print errors.
void add_color_option(CLI::App& app, std::string& color);

/// The pose in the value "x,y,z,roll,pitch,yaw" of `option`, in metres and radians.
/// @param or_else  what else the option accepts, for the message: " or 'auto'"
/// Errors: a usage error.
[[nodiscard]] Result<Pose> parse_pose(std::string_view option, const std::string& text,
                                      std::string_view or_else = "");

/// Limits TBB to `jobs` threads for as long as the object lives.
class ThreadLimit {
 public:
  /// @param jobs  0 for all cores
  explicit ThreadLimit(std::size_t jobs);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Control;
  std::unique_ptr<Control> control_;
};

/// The error as one line; "error:" is red if the style is coloured.
[[nodiscard]] std::string to_string(const Error& error, const Style& style);

/// The whole body of a main(): parses the arguments, runs the program, and prints an error as one
/// line on stderr. Answers the query of shells, see completion.hpp.
/// @return 0; 1 if `run` failed or threw; 2 for wrong usage
[[nodiscard]] int run_program(CLI::App& app, int argc, char** argv,
                              const std::function<Result<void>()>& run);

/// An error in the way a program was called: exit code 2.
[[nodiscard]] tl::unexpected<Error> usage_error(std::string message);

}  // namespace vantage::cli
