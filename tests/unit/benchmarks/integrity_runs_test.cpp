#include "integrity_runs.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace vantage::benchmarks {
namespace {

JudgedScan scan(Tracking tracking, double metres, double risk = 1.0) {
  return {.tracking = tracking, .risk = risk, .has_pose = true, .metres = metres};
}

constexpr double kRight = 0.1, kWrong = 0.6;

TEST_CASE("what is right") {
  CHECK(scan(Tracking::lost, 0.5).is_right());
  CHECK_FALSE(scan(Tracking::lost, 0.51).is_right());
  JudgedScan turned = scan(Tracking::tracked, 0.0);
  turned.degrees = 3.1;
  CHECK_FALSE(turned.is_right());
  JudgedScan nowhere = scan(Tracking::tracked, 0.0);
  nowhere.has_pose = false;
  CHECK_FALSE(nowhere.is_right());
  // Where no pose is right.
  CHECK_FALSE(scan(Tracking::tracked, std::numeric_limits<double>::infinity()).is_right());
}

TEST_CASE("the verdict of runs") {
  JudgedRun run;
  run.scans = {scan(Tracking::tracked, kRight),   scan(Tracking::tracked, kWrong),
               scan(Tracking::lost, kRight),      scan(Tracking::lost, kWrong),
               scan(Tracking::uncertain, kRight), scan(Tracking::tracked, kWrong),
               scan(Tracking::lost, kWrong),      scan(Tracking::tracked, kRight)};
  run.scans[1].misled = true;
  run.scans[6].misled = true;
  Verdict verdict;
  verdict.add(run);
  CHECK(verdict.scans == 8);
  CHECK(verdict.wrong_of_tracked.hits == 2);
  CHECK(verdict.wrong_of_tracked.of == 4);
  CHECK(verdict.lost_of_right.hits == 1);
  CHECK(verdict.lost_of_right.of == 4);
  CHECK(verdict.uncertain.hits == 1);
  CHECK(verdict.finds == 2);
  CHECK(verdict.wrong_finds == 1);
  // Not found before it was misled again; then by the scan after.
  REQUIRE(verdict.found_after.size() == 2);
  CHECK(std::isinf(verdict.found_after[0]));
  CHECK(verdict.found_after[1] == 1.0);
  verdict.add(run);
  CHECK(verdict.scans == 16);
}

TEST_CASE("consecutive scans that are tracked and wrong are one stretch") {
  JudgedRun run;
  run.scans = {scan(Tracking::tracked, kWrong, 1e-3),
               scan(Tracking::tracked, 7.0, 1e-5),  // one
               scan(Tracking::tracked, kRight),
               scan(Tracking::tracked, kWrong),  // two
               scan(Tracking::uncertain, kWrong),
               scan(Tracking::tracked, kWrong),  // three
               scan(Tracking::lost, 100.0)};
  for (JudgedScan& scan : run.scans) scan.driven = 500.0;
  Verdict verdict;
  verdict.add(run);
  CHECK(verdict.wrong_of_tracked.hits == 4);
  CHECK(verdict.stretches == 3);
  CHECK(verdict.kilometres == doctest::Approx(3.5));
  CHECK(verdict.farthest == 7.0);
  CHECK(verdict.least_risk == 1e-5);
  // A run that begins as another ended begins a stretch of its own.
  JudgedRun other;
  other.scans = {scan(Tracking::tracked, kWrong)};
  verdict.add(other);
  verdict.add(other);
  CHECK(verdict.stretches == 5);
}

TEST_CASE("the goals of a verdict") {
  JudgedRun clear, ambiguous;
  ambiguous.ambiguous = true;
  for (int k = 0; k < 2000; ++k) {
    clear.scans.push_back(scan(k % 40 == 0 ? Tracking::uncertain : Tracking::tracked, kRight));
    clear.scans.back().driven = 10.0;
    ambiguous.scans.push_back(scan(Tracking::uncertain, kRight));
    ambiguous.scans.back().driven = 5.0;
  }
  const auto met = [](const std::vector<JudgedRun>& runs) {
    std::vector<std::string> names;
    for (const Goal& goal : goals(verdict_of(those(runs, [](const JudgedRun&) { return true; })))) {
      CHECK(goal.interval.low <= goal.value);
      CHECK(goal.value <= goal.interval.high);
      if (goal.is_met()) names.push_back(goal.name);
    }
    return names;
  };
  using Names = std::vector<std::string>;
  CHECK(met({clear, ambiguous}) == Names{"wrong", "stretches", "lost", "uncertain"});
  // One stretch of two scans in 30 km: too many scans, but not too many stretches.
  clear.scans[100] = clear.scans[101] = scan(Tracking::tracked, kWrong);
  CHECK(met({clear, ambiguous}) == Names{"stretches", "lost", "uncertain"});
  clear.scans[500] = scan(Tracking::tracked, kWrong);
  CHECK(met({clear, ambiguous}) == Names{"lost", "uncertain"});
  for (std::size_t k = 0; k < 30; ++k) {
    clear.scans[2 * k].tracking = Tracking::lost;
    clear.scans[1000 + k].tracking = Tracking::uncertain;
  }
  CHECK(met({clear, ambiguous}).empty());
}

TEST_CASE("whether a stated risk is kept") {
  JudgedRun run;
  for (int k = 0; k < 400; ++k) {
    run.scans.push_back(scan(Tracking::tracked, k % 100 < 2 ? kWrong : kRight, 0.01));
  }
  run.scans.push_back(scan(Tracking::lost, kWrong, 0.5));
  const Calibration high = calibration({&run}, 0.1);
  CHECK(high.wrong.of == 400);
  CHECK(high.wrong.hits == 8);
  CHECK(high.wrong_by_stretch.hits == 4);
  CHECK(high.wrong_by_stretch.of == 396);
  CHECK(high.stated == doctest::Approx(0.01));
  CHECK(kept(high.wrong, 0.1) == Kept::yes);
  CHECK(kept(high.wrong, 0.02) == Kept::undecided);
  CHECK(kept(high.wrong_by_stretch, 0.03) == Kept::yes);
  CHECK(kept(high.wrong, 0.003) == Kept::no);
  const Calibration none = calibration({&run}, 0.001);
  CHECK(none.wrong.of == 0);
  CHECK(kept(none.wrong, 0.001) == Kept::undecided);
}

TEST_CASE("the JSON has every scan") {
  JudgedRun run{.world = "plain", .seed = 7, .matcher = "ndt", .map = "whole"};
  run.scans = {scan(Tracking::tracked, kRight, 0.25), scan(Tracking::lost, kWrong)};
  run.scans[0].nvtl = 1.5;
  run.scans[1].has_pose = false;
  const auto json = nlohmann::json::parse(to_json({run}));
  REQUIRE(json["scans"].size() == 2);
  const auto& first = json["scans"][0];
  CHECK(first["world"] == "plain");
  CHECK(first["seed"] == 7);
  CHECK(first["tracking"] == "tracked");
  CHECK(first["risk"] == 0.25);
  CHECK(first["nvtl"] == 1.5);
  CHECK(first["coverage"].is_null());
  CHECK(json["scans"][1]["error_m"].is_null());
  CHECK(json["total"]["scans"] == 2);
  CHECK(json["worlds"]["plain"]["tracked"] == 1);
  CHECK(json["worlds"]["plain"]["goals"].size() == 4);
}

}  // namespace
}  // namespace vantage::benchmarks
