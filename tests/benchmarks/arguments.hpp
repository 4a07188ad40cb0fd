#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "terminal/command_line.hpp"

namespace vantage::benchmarks {

/// The arguments of a benchmark's program; what several of them take is spelled out here.
class Arguments {
 public:
  void program(const std::string& name, const std::string& description) {
    app_.name(name);
    app_.description(description);
  }

  template <class T>
  CLI::Option* add(const std::string& name, T& value, const std::string& help,
                   const std::string& type) {
    return app_.add_option(name, value, help)->type_name(type);
  }
  template <class T>
  CLI::Option* add(const std::string& name, T& value, const std::string& help,
                   const std::string& type, const CLI::Validator& check) {
    return add(name, value, help, type)->check(check);
  }
  /// The same, with the value that it has in the help.
  template <class T, class... Check>
  CLI::Option* shown(const std::string& name, T& value, const std::string& help,
                     const std::string& type, const Check&... check) {
    return add(name, value, help, type, check...)->capture_default_str();
  }
  void flag(const std::string& name, bool& value, const std::string& help) {
    app_.add_flag(name, value, help);
  }

  void scan_voxel(double& metres) {
    shown("--scan-voxel", metres, "scans are thinned to voxels of this edge", "M",
          CLI::PositiveNumber);
  }
  void svg(std::filesystem::path& file) { add("--svg", file, "where to write the plot", "FILE"); }

  [[nodiscard]] CLI::App& app() noexcept { return app_; }

 private:
  CLI::App app_;
};

/// A program that prints tables: `declare(arguments, options)` says what it is and takes,
/// `run(options)` is its work.
/// @return  its main()
template <class Options, class Work>
[[nodiscard]] auto table(void (*declare)(Arguments&, Options&), Work run) {
  return [declare, run](int argc, char** argv) {
    Arguments arguments;
    Options options;
    declare(arguments, options);
    return cli::run_program(arguments.app(), argc, argv, [&] { return run(options); });
  };
}

}  // namespace vantage::benchmarks
