#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/json.hpp"
#include "vantage/evaluation/run_files.hpp"

using namespace vantage;

namespace {

/// A drive along x, 2 m a scan, whose estimates are off by what `estimate` does to the truth.
template <class F>
Run drive(std::size_t scans, const F& estimate) {
  Run run;
  for (std::size_t i = 0; i < scans; ++i) {
    RunScan scan;
    Pose truth;
    truth.translation.x() = 2.0 * static_cast<double>(i);
    scan.reference = truth;
    scan.report.tracking = Tracking::tracked;
    scan.report.T_map_scan = estimate(i, truth);
    run.scans.push_back(scan);
  }
  return run;
}

}  // namespace

TEST_CASE("a constant offset is no relative error") {
  const RunSummary s = summarize(drive(20, [](std::size_t, Pose truth) {
    truth.translation.y() += 0.3;
    return truth;
  }));
  CHECK(s.relative_frame.m.count == 19);
  CHECK(s.relative_frame.m.max == doctest::Approx(0.0));
  CHECK(s.relative_10m.m.count == 15);  // five scans of 2 m make 10 m
  CHECK(s.relative_10m.m.max == doctest::Approx(0.0));
}

TEST_CASE("drift adds up over 10 m") {
  const RunSummary s = summarize(drive(20, [](std::size_t i, Pose truth) {
    truth.translation.x() += 0.01 * static_cast<double>(i);
    return truth;
  }));
  CHECK(s.relative_frame.m.mean == doctest::Approx(0.01));
  CHECK(s.relative_10m.m.mean == doctest::Approx(0.05));
  CHECK(s.relative_10m.deg.max == doctest::Approx(0.0));
}

TEST_CASE("a turn between scans is a relative error in degrees") {
  const RunSummary s = summarize(drive(11, [](std::size_t i, Pose truth) {
    truth.rotation = pose_from_xyz_rpy({0, 0, 0}, {0, 0, i >= 5 ? M_PI / 180 : 0.0}).rotation;
    return truth;
  }));
  CHECK(s.relative_frame.deg.max == doctest::Approx(1.0));
  CHECK(s.relative_frame.deg.mean == doctest::Approx(0.1));
}

TEST_CASE(
    "scans that are not tracked and scans without a reference are left out of relative errors") {
  Tracking state = Tracking::lost;
  SUBCASE("lost") {}
  SUBCASE("uncertain") { state = Tracking::uncertain; }
  Run run = drive(20, [](std::size_t, Pose truth) { return truth; });
  run.scans[7].report.tracking = state;
  run.scans[7].report.T_map_scan.translation.y() = 50;
  run.scans[12].reference.reset();
  const RunSummary s = summarize(run);
  CHECK(s.relative_frame.m.count == 15);
  CHECK(s.relative_frame.m.max == doctest::Approx(0.0));
  CHECK(s.relative_10m.m.max == doctest::Approx(0.0));
}

TEST_CASE("scans.csv says the way along the reference") {
  const std::string csv = to_csv(drive(3, [](std::size_t, Pose truth) { return truth; }));
  std::istringstream lines(csv);
  const auto next_cells = [&] {
    std::string line, cell;
    std::getline(lines, line);
    std::istringstream in(line);
    std::vector<std::string> cells;
    while (std::getline(in, cell, ',')) cells.push_back(cell);
    return cells;
  };
  const std::vector<std::string> names = next_cells();
  const auto at = std::find(names.begin(), names.end(), "distance_m") - names.begin();
  REQUIRE(names.at(static_cast<std::size_t>(at) + 1) == "ref_x");
  for (const auto& [distance, x] : {std::pair("0.0000", "0"), {"2.0000", "2"}, {"4.0000", "4"}}) {
    const std::vector<std::string> cells = next_cells();
    CHECK(cells.at(static_cast<std::size_t>(at)) == distance);
    CHECK(cells.at(static_cast<std::size_t>(at) + 1) == x);
  }
}
