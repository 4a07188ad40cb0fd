// vantage-info: what a recording or a map holds.
#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "info/recording_info.hpp"
#include "terminal/command_line.hpp"
#include "terminal/progress.hpp"
#include "vantage/io/formats.hpp"

namespace vantage {
namespace {

struct Options {
  io::ScanOptions scans;
  bool quiet = false;
  bool json = false;
  std::string color = "auto";
};

Result<void> run(const Options& options) {
  RecordingInfo info;
  {
    cli::Progress progress("reading (scans)", options.quiet);
    VANTAGE_TRY(info, inspect(options.scans, [&](std::size_t done, std::size_t total) {
                  progress.update(done, total);
                }));
  }
  if (options.json) {
    std::cout << to_json(info).dump(2, ' ', false, nlohmann::json::error_handler_t::replace)
              << '\n';
  } else {
    std::cout << to_text(info, cli::Style::of(STDOUT_FILENO, options.color));
  }
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Prints what a recording or a map contains: format, topics, scans, points, fields, extent, "
      "rate, gaps.",
      "vantage info");
  vantage::Options options;
  app.add_option("PATH", options.scans.path,
                 fmt::format("folder of scans or map tiles, {}, {}",
                             vantage::io::format_names(vantage::io::FormatUse::recording, ", "),
                             vantage::io::format_names(vantage::io::FormatUse::cloud)))
      ->required();
  app.add_option("--topic", options.scans.topic, "topic of the scans, if a bag has several");
  app.add_option("--rate", options.scans.rate_hz, "scans per second, if files contain no stamps")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("-q,--quiet", options.quiet, "no progress on stderr");
  app.add_flag("--json", options.json, "results as JSON on stdout");
  app.add_flag_callback(
      "--formats",
      [&] {
        std::cout << vantage::formats_text(vantage::cli::Style::of(STDOUT_FILENO, options.color));
        throw CLI::Success();
      },
      "list the formats that are read, and exit");
  vantage::cli::add_color_option(app, options.color);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
