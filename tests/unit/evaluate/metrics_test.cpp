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
  const std::string csv = csv_header();
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

TEST_CASE("metrics: docs/files.md says which columns older files lack") {
  const std::string docs = test::read_text(VANTAGE_SOURCE_DIR "/docs/files.md");
  const auto from = docs.find("Programs also read older files, which have no column");
  REQUIRE(from != std::string::npos);
  const std::string list = docs.substr(from, docs.find(".\n", from) - from);
  for (const Metric& metric : metrics()) {
    const std::string key(metric.key);
    CHECK_MESSAGE(metric.is(kNotInOldFiles) == (list.find("`" + key + "`") != std::string::npos),
                  key);
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

RunScan located(Tracking tracking, double metres, double risk) {
  RunScan scan;
  scan.report.tracking = tracking;
  scan.report.risk = risk;
  scan.error = PoseError{.metres = metres};
  return scan;
}

TEST_CASE("a scan is tracked, uncertain or lost; what is not tracked is not called lost") {
  Run run;
  run.scans = {located(Tracking::tracked, 0.1, 1e-6), located(Tracking::uncertain, 0.2, 0.02),
               located(Tracking::uncertain, 9.0, 0.5), located(Tracking::lost, 8.0, 0.9)};
  const RunSummary s = summarize(run);
  CHECK(s.scans == 4);
  CHECK(s.tracked == 1);
  CHECK(s.count("uncertain") == 2);
  CHECK(s.count("lost") == 1);
  CHECK(s.count("far_off") == 2);
  CHECK(s.count("wrong") == 0);
  CHECK(s["error_m"].count == 1);
  const auto json = to_json(run, s);
  CHECK(json["scans"]["uncertain"] == 2);
  CHECK(json["scans"]["lost"] == 1);
}

TEST_CASE(
    "a tracked scan beyond the alert limit is misleading, and wrong only beyond 2 m or 5 deg") {
  const Metric& misleading = *find_metric("misleading");
  const Metric& wrong = *find_metric("wrong");
  const auto at = [](Tracking tracking, double metres, double degrees) {
    RunScan scan = located(tracking, metres, 0.1);
    scan.error->degrees = degrees;
    return scan;
  };
  CHECK(misleading.value(at(Tracking::tracked, 0.5, 3.0)) == 0.0);
  CHECK(misleading.value(at(Tracking::tracked, 0.501, 0.0)) == 1.0);
  CHECK(misleading.value(at(Tracking::tracked, 0.0, 3.01)) == 1.0);
  CHECK(wrong.value(at(Tracking::tracked, 0.501, 3.01)) == 0.0);
  for (const Tracking tracking : {Tracking::uncertain, Tracking::lost}) {
    CHECK_FALSE(misleading.value(at(tracking, 9.0, 9.0)));
    CHECK_FALSE(wrong.value(at(tracking, 9.0, 9.0)));
  }
  RunScan unknown = at(Tracking::tracked, 9.0, 9.0);
  unknown.error.reset();
  CHECK_FALSE(misleading.value(unknown));
}

TEST_CASE("misleading follows the alert limit of the run, and wrong does not") {
  RunScan scan = located(Tracking::tracked, 0.3, 0.1);
  scan.error->degrees = 1.5;
  const Metric& misleading = *find_metric("misleading");
  CHECK(misleading.value(scan) == 0.0);
  scan.alert_limit = {.metres = 0.2, .degrees = 3.0};
  CHECK(misleading.value(scan) == 1.0);
  scan.alert_limit = {.metres = 0.5, .degrees = 1.0};
  CHECK(misleading.value(scan) == 1.0);
  scan.alert_limit = {.metres = 10.0, .degrees = 45.0};
  scan.error->metres = 3.0;
  CHECK(misleading.value(scan) == 0.0);
  CHECK(find_metric("wrong")->value(scan) == 1.0);
}

TEST_CASE("the risk of every scan with a pose counts, with its significant digits") {
  Run run;
  run.scans = {located(Tracking::tracked, 0.1, 1e-6), located(Tracking::uncertain, 0.1, 0.2),
               located(Tracking::lost, 0.1, 0.7), located(Tracking::lost, 0.1, 1.0)};
  run.scans.back().report.has_pose = false;
  const Statistics risk = summarize(run)["risk"];
  CHECK(risk.count == 3);
  CHECK(risk.min == 1e-6);
  CHECK(risk.median == doctest::Approx(0.2));
  CHECK(risk.max == 0.7);
  const Metric& metric = *find_metric("risk");
  CHECK(shown(metric, 1.23e-6) == "1.2e-06");
  CHECK(shown(metric, 0.0) == "0");
  CHECK(shown(metric, 0.257) == "0.26");
  CHECK(shown(metric, 1.0) == "1");
  CHECK(csv_line(run.scans.front(), 0.0).find(",1e-06,") != std::string::npos);
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
