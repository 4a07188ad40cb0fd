// The ground filters beside PCL's in one run, as a table: the eight ISPRS samples, all of them side
// by side, and the recorded street.
#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "ground_peers.hpp"
#include "ground_samples.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "terminal/command_line.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/statistics.hpp"
#include "vantage/ground_filter.hpp"

namespace vantage::benchmarks {
namespace {

const std::vector<std::string> kFilters{"pmf", "smrf", "pcl_pmf", "pcl_approximate_pmf"};

struct Options {
  std::vector<std::string> filters = kFilters;
  std::size_t points = kMany;
  bool pcl_street = false;
};

struct Measured {
  IndexList ground;
  double milliseconds;
};

/// Runs until half a second is spent, at least once.
Result<Measured> measure(const std::function<Result<IndexList>()>& find) {
  constexpr double kEnough = 500.0;  // [ms]
  std::vector<double> times;
  IndexList ground;
  for (double spent = 0.0; spent < kEnough; spent += times.back()) {
    const double before = cpu_seconds();
    VANTAGE_TRY(ground, find());
    times.push_back(1e3 * (cpu_seconds() - before));
  }
  return Measured{std::move(ground), statistics_of(times).median};
}

/// By filter, in the order asked for.
Result<std::vector<Measured>> measure_all(PointsView cloud, const Options& options) {
  const PclGround pcl(cloud);  // not timed: PCL has clouds of its own
  std::vector<Measured> all;
  for (const std::string& name : options.filters) {
    PluginPtr<GroundFilter> filter;
    std::function<Result<IndexList>()> find;
    if (name == "pcl_pmf") {
      find = [&] { return pcl.progressive(); };
    } else if (name == "pcl_approximate_pmf") {
      find = [&] { return pcl.approximate(); };
    } else {
      filter = test::plugin<GroundFilter>(name);
      find = [&] { return filter->ground(cloud); };
    }
    VANTAGE_TRY(auto measured, measure(find));
    all.push_back(std::move(measured));
  }
  return all;
}

std::string percent(double value) { return fmt::format("{:.1f}", value); }

/// Sums of what the rows of one filter say.
struct Sum {
  double milliseconds = 0.0;
  GroundErrors errors{};
};

void print_row_of(const std::string& input, std::size_t points, const std::string& filter,
                  double milliseconds, double first, const std::optional<GroundErrors>& errors) {
  std::vector<std::string> row{input, cli::grouped(points), filter,
                               fmt::format("{:.1f}", milliseconds),
                               fmt::format("{:.2f}", milliseconds / first)};
  if (errors) {
    for (const double value : {errors->type_1, errors->type_2, errors->total, errors->kappa}) {
      row.push_back(percent(value));
    }
  } else {
    row.resize(row.size() + 4);
  }
  print_row(row);
}

/// @return  by filter, what its rows say
Result<std::vector<Sum>> compare(const std::string& input, const LabelledCloud& cloud,
                                 bool has_labels, const Options& options) {
  VANTAGE_TRY(const auto all, measure_all(cloud.points, options));
  std::vector<Sum> figures;
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::optional<GroundErrors> errors;
    if (has_labels) errors = errors_of(cloud, all[i].ground);
    print_row_of(input, cloud.points.size(), options.filters[i], all[i].milliseconds,
                 all.front().milliseconds, errors);
    figures.push_back({all[i].milliseconds, errors.value_or(GroundErrors{})});
  }
  return figures;
}

Result<void> compare_samples(const std::filesystem::path& folder, const Options& options) {
  const std::vector<LabelledCloud> samples = ground_samples(folder);
  std::vector<Sum> sums(options.filters.size());
  std::size_t points = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    VANTAGE_TRY(const auto figures, compare("samp" + kGroundSamples[i], samples[i], true, options));
    for (std::size_t k = 0; k < sums.size(); ++k) {
      sums[k].milliseconds += figures[k].milliseconds;
      sums[k].errors.type_1 += figures[k].errors.type_1;
      sums[k].errors.type_2 += figures[k].errors.type_2;
      sums[k].errors.total += figures[k].errors.total;
      sums[k].errors.kappa += figures[k].errors.kappa;
    }
    points += samples[i].points.size();
  }
  const auto n = static_cast<double>(samples.size());
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const GroundErrors& sum = sums[k].errors;
    print_row_of("mean", points / samples.size(), options.filters[k], sums[k].milliseconds / n,
                 sums.front().milliseconds / n,
                 GroundErrors{sum.type_1 / n, sum.type_2 / n, sum.total / n, sum.kappa / n});
  }
  VANTAGE_CHECK(compare("side by side", side_by_side(samples, options.points), true, options));
  return {};
}

Result<void> run(const Options& options) {
  const cli::ThreadLimit one_thread(1);
  print_head("Ground filters, 1 thread, CPU time", {"input", "points", "filter", "ms", "ratio",
                                                    "type I %", "type II %", "total %", "kappa %"});
  if (const auto folder = test::real_data("isprs_ground")) {
    VANTAGE_CHECK(compare_samples(*folder, options));
  }
  if (const auto folder = test::real_data("kitti_street")) {
    Options on_street = options;
    if (!options.pcl_street) std::erase(on_street.filters, "pcl_pmf");
    if (on_street.filters.empty()) return {};
    VANTAGE_CHECK(compare("street", read_labelled(*folder / "map.pcd"), false, on_street));
  }
  return {};
}

void declare(Arguments& arguments, Options& options) {
  arguments.program(
      "./dev bench ground",
      "Ground filters beside PCL's on labelled samples and the recorded street, as a markdown "
      "table.");
  arguments
      .add("--filters", options.filters,
           "only these, the first being what the others are compared with: pmf, smrf, "
           "pcl_pmf, pcl_approximate_pmf",
           "A,B,...", CLI::IsMember(kFilters))
      ->delimiter(',');
  arguments.shown("--points", options.points,
                  "the samples side by side, made so much denser that there are so many points",
                  "N", CLI::PositiveNumber);
  arguments.flag("--pcl-street", options.pcl_street,
                 "also pcl_pmf on the street, where it takes many minutes");
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
