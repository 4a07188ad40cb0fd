// The table of metrics, and that what is made from it has every row.
#include "vantage/evaluation/metrics.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "evaluation/json.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/evaluation/run_files.hpp"

namespace vantage {
namespace {

TEST_CASE("metrics: keys are unique, statistics are known, signs of units are in keys") {
  std::set<std::string_view> keys;
  for (const Metric& metric : metrics()) {
    CAPTURE(metric.key);
    CHECK(keys.insert(metric.key).second);
    CHECK(find_metric(metric.key) == &metric);
    const auto words = [](std::string_view names) {
      return names.empty() ? 0 : 1 + std::count(names.begin(), names.end(), ' ');
    };
    CHECK(statistics_in(metric.statistics).size() ==
          static_cast<std::size_t>(words(metric.statistics)));
    CHECK(statistics_in(metric.brief).size() == static_cast<std::size_t>(words(metric.brief)));
    CHECK_FALSE(metric.statistics.empty());
    CHECK_FALSE(metric.doc.empty());
    CHECK_FALSE(metric.doc.ends_with('.'));
    const std::string_view shown = metric.unit->shown;
    CHECK(metric.key.ends_with("_ms") == (shown == "ms"));
    CHECK(metric.key.ends_with("_deg") == (shown == "deg"));
    CHECK(metric.key.ends_with("_bytes") == (shown == "MB"));
    CHECK(metric.key.ends_with("_m") == (shown == "cm"));
  }
  CHECK(find_metric("none") == nullptr);
}

TEST_CASE("metrics: each is in scans.csv, summary.json and docs/files.md") {
  const std::string csv = to_csv(Run{});
  const auto json = to_json(Run{}, summarize(Run{}));
  const std::string docs = test::read_text(VANTAGE_SOURCE_DIR "/docs/files.md");
  for (const Metric& metric : metrics()) {
    const std::string key(metric.key);
    CAPTURE(key);
    const bool column = csv.find("," + key + ",") != std::string::npos;
    CHECK(column != metric.is(kNotInFiles));
    CHECK((metric.is_count() ? json["scans"] : json).contains(key));
    const std::string row = fmt::format("| `{}` | {} | {} |\n", key, metric.statistics, metric.doc);
    CHECK_MESSAGE(docs.find(row) != std::string::npos, "docs/files.md lacks the line " << row);
  }
}

RunScan aligned(double seconds, double fitness) {
  RunScan scan;
  scan.map.points = 100;
  scan.wide_area_points = 400;
  scan.report.tracking = Tracking::tracked;
  scan.report.map_points = 100;
  scan.report.seconds_align = seconds;
  scan.report.alignment = Alignment{};
  scan.report.alignment->score.fitness = fitness;
  return scan;
}

TEST_CASE("scans that were never aligned are left out of means, and are dashes alone") {
  Run run;
  const auto partition = Partition::from({Region{"all", HalfOpenBox{{-1, -1}, {1, 1}}, {}}});
  run.index.partition = *partition;
  run.scans = {RunScan{}, aligned(0.002, 1.5), RunScan{}, aligned(0.004, 2.5)};
  const RunSummary s = summarize(run);
  CHECK(s["align_ms"].count == 2);
  CHECK(s["align_ms"].mean == doctest::Approx(3.0));
  CHECK(s["map_points"].mean == doctest::Approx(100.0));
  CHECK(s["fitness"].mean == doctest::Approx(2.0));
  CHECK(s["reduction_used"].mean == doctest::Approx(0.75));
  CHECK(s.count("lost") == 2);

  run.scans = {RunScan{}, RunScan{}};
  const auto json = to_json(run, summarize(run));
  for (const char* key : {"align_ms", "map_points", "fitness", "nvtl", "lcp", "reduction_used"}) {
    CAPTURE(key);
    CHECK(json[key]["count"] == 0);
    CHECK(json[key]["mean"].is_null());
  }
  CHECK(json["scans"]["wrong"].is_null());    // none is tracked
  CHECK(json["scans"]["far_off"].is_null());  // nobody knows without a reference
}

TEST_CASE("of a map that holds no points, neither their number nor what follows from it is known") {
  RunScan scan = aligned(0.002, 1.5);
  scan.map = {.elements = 100};
  for (const char* key : {"map_points", "lcp", "reduction_used"}) {
    CHECK_FALSE(find_metric(key)->value(scan));
  }
  CHECK(find_metric("fitness")->value(scan));
}

}  // namespace
}  // namespace vantage
