#include "localize/verdict.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace vantage;

namespace {

const MotionInputs kNoInputs({});

/// A pose that was predicted to a centimetre.
Hypothesis predicted() {
  Hypothesis one;
  one.motion.emplace(0.0, Pose{}, 1e-4 * PoseMatrix::Identity(), kNoInputs);
  return one;
}

/// A pose to which a scan was aligned, to a centimetre.
Hypothesis aligned() {
  Hypothesis one = predicted();
  one.alignment = Alignment{};
  one.R = 1e-4 * PoseMatrix::Identity();
  return one;
}

ScanReport judged(const Hypothesis& best, const Known& known, const LocalizerParams& params = {},
                  std::size_t scan_points = 100) {
  ScanReport report;
  report.map_points = 1000;
  report.scan_points = scan_points;
  Hypothesis believed = best;
  believed.belief = 1.0 - known.elsewhere;
  static_cast<void>(conclude({believed}, known, kNoInputs, {}, params, report));
  return report;
}

}  // namespace

TEST_CASE("a belief beyond doubt is tracked once it was compared with all other places") {
  const ScanReport sure = judged(aligned(), {.elsewhere = 1e-4, .compared = true});
  CHECK(sure.tracking == Tracking::tracked);
  CHECK(sure.reason.empty());
  CHECK(sure.risk < 0.001);
  const ScanReport alone = judged(aligned(), {.elsewhere = 1e-4});
  CHECK(alone.tracking == Tracking::uncertain);
  CHECK_FALSE(alone.compared);
}

TEST_CASE("who is probably elsewhere is lost, unless the scan scores as usual") {
  Known known{.elsewhere = 0.9, .compared = true};
  CHECK(judged(aligned(), known).tracking == Tracking::lost);
  known.scores_as_usual = true;
  const ScanReport open = judged(aligned(), known);
  CHECK(open.tracking == Tracking::uncertain);
  CHECK(open.reason == "the scan fits the map as well beside this pose");
  CHECK(open.risk >= 0.9);
}

TEST_CASE("a scan that matched nothing is lost, whatever is believed") {
  Hypothesis nothing = predicted();
  nothing.failure = "too few matches";
  const ScanReport report =
      judged(nothing, {.elsewhere = 1e-4, .compared = true, .scores_as_usual = true});
  CHECK(report.tracking == Tracking::lost);
  CHECK(report.reason == "too few matches");
}

TEST_CASE("a pose that was not compared with the map is not tracked, whatever risk is accepted") {
  LocalizerParams params;
  params.max_risk = 0.3;
  const ScanReport alone = judged(aligned(), {.elsewhere = 1e-4}, params);
  CHECK(alone.tracking == Tracking::uncertain);
  CHECK(alone.reason == "not compared with the rest of the map yet");
}

TEST_CASE("a pose at which the sensor would lie on its side says so, if it is not believed") {
  const Known lying{.elsewhere = 0.1, .compared = true, .upright = false};
  CHECK(judged(aligned(), lying).reason == "the sensor would lie on its side here");
  const Known certain{.elsewhere = 1e-4, .compared = true, .upright = false};
  CHECK(judged(aligned(), certain).tracking == Tracking::tracked);
}

TEST_CASE("a scan without points says nothing: it is uncertain where the motion led") {
  Hypothesis nothing = predicted();
  nothing.failure = "too few matches";
  const ScanReport report = judged(nothing, {.elsewhere = 1e-4, .compared = true}, {}, 0);
  CHECK(report.tracking == Tracking::uncertain);
  CHECK(report.reason == "the scan has no points");
}

TEST_CASE("the published covariance is that of the published pose") {
  ScanReport report;
  report.scan_points = 100;
  const Known known{.elsewhere = 1e-4, .compared = true};
  Hypothesis one = aligned();
  one.alignment->T_map_scan.translation.x() = 0.02;
  const MotionFilter fitting = conclude({one}, known, kNoInputs, {}, LocalizerParams{}, report);
  CHECK(fitting.pose().translation.x() == doctest::Approx(0.01));  // both are equally sure
  const double sure = report.confidence->sigma_translation[0];
  one.motion.emplace(0.0, Pose{}, PoseMatrix::Identity(), kNoInputs);  // a vague prediction
  one.is_refuted = true;  // and a scan that does not fit
  const MotionFilter predicted = conclude({one}, known, kNoInputs, {}, LocalizerParams{}, report);
  CHECK(predicted.pose().translation.x() == 0.0);
  CHECK(report.confidence->sigma_translation[0] == doctest::Approx(std::sqrt(1.5)).epsilon(0.01));
  CHECK(sure < 0.03);
  CHECK(report.tracking == Tracking::uncertain);
}

TEST_CASE("a pose at a stamp beside the middle of the sweep is as sure as its speed") {
  ScanReport report;
  report.scan_points = 100;
  report.stamp = -0.05;  // the filter is at 0, and its speed unknown: 8 m/s
  const Known known{.elsewhere = 1e-4, .compared = true};
  Hypothesis best = aligned();
  best.belief = 1.0 - known.elsewhere;
  static_cast<void>(conclude({best}, known, kNoInputs, {}, LocalizerParams{}, report));
  CHECK(report.confidence->sigma_translation[0] ==
        doctest::Approx(0.4 * std::sqrt(1.5)).epsilon(0.05));
  CHECK(report.tracking == Tracking::uncertain);
  CHECK(report.reason == "the speed of the sensor is not known yet");
}

TEST_CASE("the risk of a pose is that of its error's length, not of its error along one axis") {
  // The default limit is 0.5 m.
  const auto risk_with = [](const Eigen::Vector3d& sigma) {
    Hypothesis one = predicted();
    PoseMatrix covariance = 1e-8 * PoseMatrix::Identity();
    covariance.diagonal().head<3>() = sigma.array().square() / 1.5;  // see published_covariance
    one.motion.emplace(0.0, Pose{}, covariance, kNoInputs);
    one.alignment = Alignment{};
    one.R = 1e6 * PoseMatrix::Identity();
    return judged(one, {.compared = true}).risk;
  };
  const double z = LocalizerParams{}.alert_limit / 0.25;
  CHECK(risk_with({0.25, 0.0, 0.0}) ==
        doctest::Approx(std::erfc(z / std::sqrt(2.0))).epsilon(1e-3));
  CHECK(risk_with({0.25, 0.25, 0.0}) == doctest::Approx(std::exp(-0.5 * z * z)).epsilon(1e-3));
  const double both_sides = std::sqrt(2.0 / std::acos(-1.0)) * z * std::exp(-0.5 * z * z);
  CHECK(risk_with({0.25, 0.1, 0.0}) >= std::erfc(z / std::sqrt(2.0)) * (1.0 - 1e-3));
  CHECK(risk_with({0.125, 0.05, 0.0}) >= std::erfc(2.0 * z / std::sqrt(2.0)) * (1.0 - 1e-3));
  CHECK(risk_with({0.25, 0.25, 0.25}) ==
        doctest::Approx(std::erfc(z / std::sqrt(2.0)) + both_sides).epsilon(1e-3));
}

TEST_CASE("where a user's limit is broken, risk and covariance are those of the prediction") {
  LocalizerParams params;
  params.min_nvtl = 9.0;
  Hypothesis far = predicted();
  far.alignment = Alignment{};
  far.alignment->T_map_scan = pose_from_xyz_rpy({5, 0, 0}, {0, 0, 0});
  far.R = 1e-6 * PoseMatrix::Identity();
  const Known known{.elsewhere = 1e-4, .compared = true};
  const ScanReport report = judged(far, known, params);
  CHECK(report.tracking == Tracking::lost);
  // The scan says that the sensor is 5 m from the pose that is reported.
  CHECK(report.risk > 0.99);
  CHECK(report.confidence.value().sigma_translation[0] ==
        doctest::Approx(std::sqrt(1.5) * 0.01).epsilon(0.01));
  Hypothesis near = aligned();
  const ScanReport there = judged(near, known, params);
  CHECK(there.tracking == Tracking::lost);
  CHECK(there.risk < 0.01);
}

TEST_CASE("a rival within the alert limit of the reported pose is no risk, one beyond it is") {
  const auto risk_beside = [](double metres) {
    Hypothesis rival = aligned();
    rival.motion.emplace(0.0, Pose{.translation = {metres, 0.0, 0.0}},
                         1e-4 * PoseMatrix::Identity(), kNoInputs);
    rival.alignment->T_map_scan.translation.x() = metres;
    ScanReport report;
    report.scan_points = 100;
    const Known known{.elsewhere = 0.001, .compared = true};
    Hypothesis best = aligned();
    best.belief = 0.6;
    rival.belief = 0.399;
    static_cast<void>(conclude({best, rival}, known, kNoInputs, {}, LocalizerParams{}, report));
    return report.risk;
  };
  CHECK(risk_beside(0.35) == doctest::Approx(0.001).epsilon(0.01));
  CHECK(risk_beside(0.7) == doctest::Approx(0.4).epsilon(0.01));
}
