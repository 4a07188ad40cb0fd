#include <doctest/doctest.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/json.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
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
  const Run run = drive(3, [](std::size_t, Pose truth) { return truth; });
  const test::TemporaryFolder folder;
  REQUIRE(write_run(run, summarize(run), folder.path()));
  std::istringstream lines(test::read_text(folder.path() / "scans.csv"));
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

TEST_CASE("a reference that begins late adds no way of its own") {
  Run run = drive(5, [](std::size_t, Pose truth) {
    truth.translation.y() = 7.0;
    return truth;
  });
  run.scans[0].reference.reset();
  run.scans[1].reference.reset();
  CHECK(distances(run) == std::vector{0.0, 2.0, 2.0, 4.0, 6.0});
  for (RunScan& scan : run.scans) scan.reference.reset();
  CHECK(distances(run) == std::vector{0.0, 2.0, 4.0, 6.0, 8.0});
}

TEST_CASE("a summary by way of the disk is that of a run in memory") {
  // Of 3 blocks and a part; 7 scans in 10 have an error.
  Run run = drive(1700, [](std::size_t i, Pose truth) {
    truth.translation.y() += 0.01 * static_cast<double>(i % 13);
    truth.translation.x() *= i % 2 == 0 ? 1.0 : 1.001;
    return truth;
  });
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    if (i % 10 < 7) run.scans[i].error = PoseError{.metres = 0.01 * static_cast<double>(i % 13)};
    run.scans[i].report.confidence = PoseConfidence{};
    if (i % 50 == 3) run.scans[i].reference.reset();
  }
  const test::TemporaryFolder folder;
  RunSummarizer summarizer(folder.path());
  for (const RunScan& scan : run.scans) REQUIRE(summarizer.add(scan));
  CHECK(std::filesystem::is_empty(folder.path()));  // the file has no name
  const auto by_disk = summarizer.summary();
  REQUIRE_MESSAGE(by_disk, to_string(by_disk.error()));
  CHECK(by_disk->relative_10m.m.count > 1000);
  CHECK((*by_disk)["error_m"].count == 1190);
  CHECK(to_json(run, *by_disk).dump() == to_json(run, summarize(run)).dump());
}

TEST_CASE("a summary and its files hold no more memory after 100,000 scans than after 10,000") {
  const test::TemporaryFolder folder;
  auto writer = RunWriter::create(folder.path());
  REQUIRE_MESSAGE(writer, to_string(writer.error()));
  RunSummarizer summarizer(folder.path());
  RunScan scan = drive(1, [](std::size_t, Pose truth) { return truth; }).scans.front();
  scan.error = PoseError{};
  std::size_t before = 0;
  for (std::size_t i = 0; i < 100'000; ++i) {
    if (i == 10'000) before = ::mallinfo2().uordblks;
    scan.report.stamp = 0.1 * static_cast<double>(i);
    scan.reference->translation.x() = 0.01 * static_cast<double>(i);
    REQUIRE(summarizer.add(scan));
    REQUIRE(writer->add(scan));
  }
  // Of each 512 numbers, their place in the file is remembered: 1.5 bytes a scan.
  CHECK(::mallinfo2().uordblks < before + 300'000);
}

TEST_CASE("a summary says whether errors are as predicted, and at the places where they are") {
  Run run = drive(60, [](std::size_t, Pose truth) { return truth; });
  CHECK_FALSE(summarize(run).predictions);
  CHECK_FALSE(to_json(run, summarize(run)).contains("predictions"));
  // Twelve squares of 10 m: 2 m a scan, and each square is passed twice.
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const auto square = static_cast<double>(i / 5);
    run.scans[i].error = PoseError{.metres = 0.01 * (square + 1.0)};
    run.scans[i].predicted = PredictedError{.expected = 0.001F * static_cast<float>(square + 1.0),
                                            .error = i == 0 ? 0.005F : 0.2F};
  }
  const std::vector<RunScan> once = run.scans;
  run.scans.insert(run.scans.end(), once.begin(), once.end());
  const auto met = [&] {
    const auto predictions = summarize(run).predictions;
    REQUIRE(predictions);
    return *predictions;
  };
  CHECK(met().errors == 120);
  CHECK(met().kept == 118);
  CHECK(met().places == 12);
  CHECK(met().rank_correlation == doctest::Approx(1.0));
  CHECK(to_json(run, summarize(run))["predictions"]["rank_correlation"] == doctest::Approx(1.0));
  CHECK(summarize(run)["expected_m"].mean == doctest::Approx(0.0065));
  SUBCASE("the other way round") {
    for (RunScan& scan : run.scans) scan.predicted->expected = 1.0F - scan.predicted->expected;
    CHECK(met().rank_correlation == doctest::Approx(-1.0));
  }
  SUBCASE("a scan that is not tracked does not count, nor does a promise without a limit") {
    run.scans[7].report.tracking = Tracking::uncertain;
    run.scans[8].predicted->error = std::numeric_limits<float>::infinity();
    CHECK(met().errors == 118);
    CHECK(met().unpromised == 1);
    CHECK(met().places == 11);  // the square of both is left with eight errors
  }
  SUBCASE("too few places to say more") {
    run.scans.resize(10);
    const auto json = to_json(run, summarize(run))["predictions"];
    CHECK(json["errors"] == 10);
    CHECK(json["places"] == 0);
    CHECK(json["rank_correlation"].is_null());
  }
}

TEST_CASE("rank correlation") {
  const std::vector a{1.0, 2.0, 3.0, 4.0}, b{2.0, 1.0, 4.0, 3.0}, equal{5.0, 5.0, 5.0, 5.0};
  CHECK(rank_correlation(a, a) == doctest::Approx(1.0));
  CHECK(rank_correlation(a, b) == doctest::Approx(0.6));
  CHECK(rank_correlation(a, equal) == 0.0);
  // Equal values share the mean of their ranks: 1, 2.5, 2.5, 4.
  CHECK(rank_correlation(a, std::vector{1.0, 2.0, 2.0, 3.0}) == doctest::Approx(0.94868));
}

TEST_CASE("a folder that cannot hold the values is named") {
  RunSummarizer summarizer("/nowhere/at/all");
  const RunScan scan = drive(1, [](std::size_t, Pose truth) { return truth; }).scans.front();
  Result<void> added;
  for (int i = 0; i < 1000 && added; ++i) added = summarizer.add(scan);
  REQUIRE_FALSE(added);
  CHECK(added.error().code == ErrorCode::io_failure);
  CHECK(to_string(added.error()).starts_with("/nowhere/at/all"));
}
