#include "localize/verdict.hpp"

#include <doctest/doctest.h>

using namespace vantage;

namespace {

/// A pose to which a scan was aligned, to a centimetre.
Hypothesis aligned() {
  Hypothesis one;
  one.alignment = Alignment{};
  one.alignment->hessian = 1e6 * Eigen::Matrix<double, 6, 6>::Identity();
  return one;
}

ScanReport judged(const Hypothesis& best, const Known& known) {
  ScanReport report;
  report.map_points = 1000;
  Verdict(LocalizerParams{}).conclude(best, known, report);
  return report;
}

}  // namespace

TEST_CASE("a belief beyond doubt is tracked once it was compared with all other places") {
  const ScanReport sure =
      judged(aligned(), {.belief = 0.9999, .elsewhere = 1e-4, .compared = true});
  CHECK(sure.tracking == Tracking::tracked);
  CHECK(sure.reason.empty());
  CHECK(sure.risk < 0.001);
  const ScanReport alone = judged(aligned(), {.belief = 0.9999, .elsewhere = 1e-4});
  CHECK(alone.tracking == Tracking::uncertain);
  CHECK(alone.risk >= 0.05);
}

TEST_CASE("who is probably elsewhere is lost, unless the scan scores as usual") {
  Known known{.belief = 0.1, .elsewhere = 0.9, .compared = true};
  CHECK(judged(aligned(), known).tracking == Tracking::lost);
  known.scores_as_usual = true;
  const ScanReport open = judged(aligned(), known);
  CHECK(open.tracking == Tracking::uncertain);
  CHECK(open.reason == "the scan fits the map as well beside this pose");
  CHECK(open.risk >= 0.9);
}

TEST_CASE("a scan that matched nothing is lost, whatever is believed") {
  Hypothesis nothing;
  nothing.failure = "too few matches";
  const ScanReport report = judged(
      nothing, {.belief = 0.9999, .elsewhere = 1e-4, .compared = true, .scores_as_usual = true});
  CHECK(report.tracking == Tracking::lost);
  CHECK(report.reason == "too few matches");
}
