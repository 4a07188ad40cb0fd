// The page of one run, as text.
#include <doctest/doctest.h>

#include <cmath>

#include "localize/run_page.hpp"
#include "report/evaluation_fixture.hpp"
#include "report/markup.hpp"
#include "support/real_data.hpp"
#include "vantage/kit/directory_of.hpp"

namespace vantage::test {
namespace {

struct Recorded {
  RunInfo run{.config = "made <here>.toml", .stamp_rule = "stamps from file names", .regions = 4};
  std::vector<RunScan> scans;
  MapIndex index;
  std::vector<checks::Note> notes;
  bool reference = false;

  [[nodiscard]] std::string page(std::size_t times = 1) const {
    const TemporaryFolder folder;
    RunPage page(folder.path());
    RunSummarizer summarizer(folder.path());
    double later = 0.0;
    for (std::size_t k = 0; k < times; ++k) {
      for (RunScan scan : scans) {
        scan.report.stamp += later;
        REQUIRE(page.add(scan));
        REQUIRE(summarizer.add(scan));
      }
      later += scans.back().report.stamp + 0.1;
    }
    const auto directory = directory_of(index);
    REQUIRE(directory);
    const auto summary = summarizer.summary();
    REQUIRE(summary);
    auto html = page.html({.run = run,
                           .summary = *summary,
                           .remarks = {"a remark with <b>"},
                           .notes = notes,
                           .regions = **directory,
                           .max_risk = 0.01,
                           .reference = reference});
    REQUIRE(html);
    return *std::move(html);
  }
};

/// A drive of 60 scans without a reference, one of them lost and one uncertain.
Recorded recorded() {
  Evaluation e = made_evaluation({.configs = {"wide", "L20"}});
  Recorded made;
  made.index = e.configs[1].index;
  for (RunScan scan : e.configs[1].routes[0].run.scans) {
    scan.reference.reset();
    scan.error.reset();
    scan.prediction_error.reset();
    scan.seconds = 1.5 * scan.report.seconds_align;
    made.scans.push_back(std::move(scan));
  }
  return made;
}

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST_CASE("the page of a run has every section with its figure, and is valid HTML") {
  const std::string page = recorded().page();
  const std::string markup = markup_of(page);
  CHECK(imbalance(markup) == "");
  CHECK(invalid_html(markup) == "");
  for (const std::string id : {"verdict", "drive", "risk", "fit", "times", "memory"}) {
    CAPTURE(id);
    CHECK(holds(page, "<section id=\"" + id + "\">"));
    CHECK(holds(page, "<a href=\"#" + id + "\">"));
  }
  for (const std::string figure : {"drive", "risk", "coverage", "nvtl", "fitness", "times",
                                   "memory", "map_points", "map_bytes"}) {
    CAPTURE(figure);
    CHECK(holds(markup, "data-file=\"" + figure + "\""));
  }
  CHECK(holds(page, "default-src 'none'"));
  CHECK_FALSE(holds(markup, "nan"));
  CHECK_FALSE(holds(markup, "<b>"));
}

TEST_CASE("the page of a run says how it went") {
  Recorded made = recorded();
  const std::string page = made.page();
  CHECK(holds(page, "lost at times"));
  CHECK(holds(page, "data-metric=\"scans.tracked\" data-value=\"58\""));
  CHECK(holds(page, "data-metric=\"scans.lost\" data-value=\"1\""));
  CHECK(holds(page, "longest lost stretch: 0.1 s"));
  CHECK(holds(page, "Nothing was noticed"));
  CHECK(holds(page, "a remark with &lt;b&gt;"));
  CHECK(holds(page, "lost: the fit is &lt;poor&gt;"));
  CHECK(count_of(page, "class=\"lost\"") == 1);
  CHECK(count_of(page, "class=\"uncertain\"") == 1);
  CHECK(holds(page, "switched to x"));
  CHECK(holds(page, "Without a reference, nobody knows the errors"));
  CHECK_FALSE(holds(page, "data-metric=\"error_m"));

  SUBCASE("tracked throughout") {
    for (RunScan& scan : made.scans) {
      scan.report.tracking = Tracking::tracked;
      scan.report.reason.clear();
    }
    const std::string good = made.page();
    CHECK(holds(good, "tracked throughout"));
    CHECK(holds(good, "never lost"));
    CHECK_FALSE(holds(good, "Why scans were not tracked"));
    CHECK(count_of(good, "class=\"lost\"") == 0);
  }
  SUBCASE("the notes of the checks") {
    made.notes = {{"scans reach 84,211 m", "give points in metres"}};
    CHECK(holds(made.page(), "scans reach 84,211 m: give points in metres"));
  }
  SUBCASE("a run that ended early") {
    made.run.failure = Error{ErrorCode::corrupt_data, "scan 61 is cut", {}, {}};
    const std::string early = made.page();
    CHECK(holds(early, "ended early"));
    CHECK(holds(early, "scan 61 is cut"));
  }
  SUBCASE("a reference is left to evaluate") {
    made.reference = true;
    CHECK(holds(made.page(), "This page does not use it: <code>vantage evaluate</code>"));
  }
  SUBCASE("a sensor that was never found") {
    for (RunScan& scan : made.scans) {
      scan.report.tracking = Tracking::lost;
      scan.report.has_pose = false;
      scan.report.alignment.reset();
      scan.report.confidence.reset();
    }
    const std::string nowhere = made.page();
    CHECK(holds(nowhere, "never tracked"));
    CHECK(holds(nowhere, "The sensor was never found."));
    CHECK(holds(nowhere, "No scan was matched."));
    CHECK(invalid_html(markup_of(nowhere)) == "");
  }
}

TEST_CASE("the page of a long run is not longer than it has to be") {
  Recorded made = recorded();
  for (std::size_t i = 0; i < made.scans.size(); ++i) {
    made.scans[i].report.reason = "NVTL " + std::to_string(0.01 * static_cast<double>(i)) + " low";
    made.scans[i].report.tracking = i % 3 == 0 ? Tracking::lost : Tracking::uncertain;
  }
  const std::string once = made.page(10), long_run = made.page(1700);  // 102,000 scans
  CHECK(long_run.size() < once.size() + 400'000);
  CHECK(holds(long_run, "102,000 scans"));
  CHECK(holds(long_run, "lost: NVTL … low"));
}

}  // namespace
}  // namespace vantage::test
