// vantage-compare: shows two runs on the same scans side by side.
#include <unistd.h>

#include <array>
#include <iostream>
#include <nlohmann/json.hpp>

#include "compare/page.hpp"
#include "evaluation/json.hpp"
#include "terminal/command_line.hpp"
#include "terminal/option_values.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/comparison.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

struct Options {
  std::filesystem::path a, b, html;
  bool json = false;
  std::string color = "auto";
};

Result<void> run(const Options& options) {
  VANTAGE_TRY(ScanTable a, read_scans(options.a));
  VANTAGE_TRY(ScanTable b, read_scans(options.b));
  if (!options.html.empty()) {
    VANTAGE_CHECK(
        cli::check_outputs("--html", std::array{options.html}, std::array{options.a, options.b}));
  }
  VANTAGE_TRY(const Comparison comparison, compare(std::move(a), std::move(b)));
  if (!options.html.empty()) {
    VANTAGE_CHECK(io::write_text_atomically(options.html, to_html(comparison)));
  }
  if (options.json) {
    std::cout << json_text(to_json(comparison));
    return {};
  }
  std::cout << "A  " << comparison.a.file.string() << "\nB  " << comparison.b.file.string() << '\n'
            << pairing_text(comparison) << "\n\n";
  const auto rows = rows_of(comparison);
  cli::TextTable table(rows.front());
  for (std::size_t i = 1; i < rows.size(); ++i) table.add(rows[i]);
  std::cout << table.to_string(cli::Style::of(STDOUT_FILENO, options.color));
  if (!options.html.empty()) std::cout << "\nreport: " << options.html.string() << '\n';
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Compares two runs on the same scans.\n"
      "Scans are paired by stamp. The table has the means, their difference with a 95 % bootstrap "
      "interval, and the share of scans where B is better.",
      "vantage compare");
  vantage::Options options;
  const char* const what = "folder that `vantage localize` or `evaluate` wrote, or its scans.csv";
  app.add_option("A", options.a, what)->required()->type_name("PATH");
  app.add_option("B", options.b, what)->required()->type_name("PATH");
  app.add_option("--html", options.html, "write a page with figures")->type_name("FILE");
  app.add_flag("--json", options.json, "results as JSON on stdout");
  vantage::cli::add_color_option(app, options.color);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
