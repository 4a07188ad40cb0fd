#include "integrity_runs.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>

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

TEST_CASE("how a misled sensor is found again") {
  JudgedRun run;
  run.scans.assign(20, scan(Tracking::tracked, kRight));
  run.scans[2] = scan(Tracking::uncertain, kWrong);  // found by the second scan
  run.scans[2].misled = true;
  run.scans[2].seconds_search = 0.02;
  run.scans[3].seconds_verdict = 0.001;
  for (std::size_t i = 6; i < 11; ++i) run.scans[i] = scan(Tracking::lost, kWrong);  // by the sixth
  run.scans[6].misled = true;
  for (std::size_t i = 14; i < 20; ++i) run.scans[i] = scan(Tracking::tracked, kWrong);  // by none
  run.scans[14].misled = run.scans[18].misled = true;
  Recovery recovery;
  recovery.add(run);
  CHECK(recovery.soon.of == 4);
  CHECK(recovery.soon.hits == 1);
  CHECK(recovery.misleading == 2);
  CHECK(recovery.wrong_scans == 6);
  CHECK(recovery.until_found.size() == 2 + 6 + 6);
  CHECK(recovery.until_found[0] == 20.0);
  CHECK(recovery.until_found[1] == 1.0);
  CHECK(recovery.otherwise.size() == 6);
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
  CHECK(high.stretches == 4);
  CHECK(high.stated == doctest::Approx(0.01));
  CHECK(kept(high) == Kept::yes);
  CHECK(kept(calibration({&run}, 0.02)) == Kept::undecided);
  Calibration understated = high;
  understated.risk = 0.003;
  CHECK(kept(understated) == Kept::no);
  const Calibration none = calibration({&run}, 0.001);
  CHECK(none.wrong.of == 0);
  CHECK(kept(none) == Kept::undecided);
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
}

}  // namespace
}  // namespace vantage::benchmarks
