#include "localize/weighing.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "support/fakes.hpp"

using namespace vantage;

namespace {

/// A hypothesis whose alignment has this level.
Hypothesis at_level(double level) {
  Hypothesis one;
  one.alignment = Alignment{};
  one.alignment->score.nvtl = level;
  one.alignment->score.coverage = 1.0;
  return one;
}

struct Bench {
  PluginPtr<ScanMatcher> matcher =
      test::in_process<test::TruthMatcher, ScanMatcher>(std::make_shared<test::Truth>());
  Weighing weighing{*matcher, {.metres = 0.5, .radians = 0.05}};

  /// By how much a comparison changes the log odds of each.
  [[nodiscard]] std::vector<double> compared(std::vector<Hypothesis> hypotheses) const {
    weighing.compare(hypotheses);
    std::vector<double> changes;
    for (const Hypothesis& one : hypotheses) {
      changes.push_back(one.support.log_odds() - Support().log_odds());
    }
    return changes;
  }

  /// Scans whose level changes by a share, up and down.
  void track(double level, double change) {
    weighing.forget();
    for (int k = 0; k < 40; ++k) {
      weighing.learn(at_level(level * (k % 2 == 0 ? 1.0 : 1.0 - change)), true);
    }
  }
};

}  // namespace

TEST_CASE("a sudden fall of the level is a surprise, where the level is usually steady") {
  Bench bench;
  CHECK_FALSE(bench.weighing.is_surprising(at_level(1.0)));  // nothing is usual yet
  bench.track(1.2, 0.01);
  CHECK_FALSE(bench.weighing.is_surprising(at_level(1.2)));
  CHECK_FALSE(bench.weighing.is_surprising(at_level(1.15)));
  CHECK(bench.weighing.is_surprising(at_level(1.05)));
  CHECK(bench.weighing.is_surprising(at_level(0.0)));

  bench.track(1.2, 0.08);  // here it is not
  CHECK_FALSE(bench.weighing.is_surprising(at_level(1.0)));
  CHECK(bench.weighing.is_surprising(at_level(0.5)));
}

TEST_CASE("what has fallen and stays so is no surprise again, and rising is none") {
  Bench bench;
  bench.track(1.2, 0.01);
  CHECK(bench.weighing.is_surprising(at_level(0.6)));
  bench.weighing.learn(at_level(0.6), false);
  CHECK_FALSE(bench.weighing.is_surprising(at_level(0.6)));
  CHECK_FALSE(bench.weighing.is_surprising(at_level(1.2)));
}

TEST_CASE("one jump of the level does not make jumps usual") {
  Bench bench;
  bench.track(1.2, 0.01);
  bench.weighing.learn(at_level(0.3), true);
  bench.weighing.learn(at_level(1.2), true);
  CHECK(bench.weighing.is_surprising(at_level(0.8)));
}

TEST_CASE("a scan scores as usual if it does not fall short of those that were tracked") {
  Bench bench;
  CHECK_FALSE(bench.weighing.scores_as_usual(at_level(1.2)));  // nothing is usual yet
  bench.track(1.2, 0.01);
  CHECK(bench.weighing.scores_as_usual(at_level(1.3)));
  CHECK(bench.weighing.scores_as_usual(at_level(1.05)));
  CHECK_FALSE(bench.weighing.scores_as_usual(at_level(0.8)));
  CHECK_FALSE(bench.weighing.scores_as_usual(Hypothesis{}));
}

TEST_CASE("the deviation of a prediction does not depend on the axes of the map") {
  PoseMatrix P = 1e-4 * PoseMatrix::Identity();
  P(0, 0) = 4.0;
  for (const double turned : {0.0, 0.5, std::numbers::pi / 4.0}) {
    PoseMatrix axes = PoseMatrix::Identity();
    axes.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(turned).toRotationMatrix();
    Hypothesis one;
    one.motion.emplace(0.0, Pose{}, PoseMatrix(axes * P * axes.transpose()), MotionInputs({}));
    CHECK(one.sigma() == doctest::Approx(2.0).epsilon(1e-6));
  }
}

TEST_CASE("a pose is not preferred less where the scan shows nothing that is sharp") {
  Bench bench;
  Hypothesis followed = at_level(1.2), found = at_level(1.1);
  followed.evidence = Evidence{.share = 0.0, .noise = 0.01};
  found.evidence = Evidence{.share = 0.3, .noise = 0.01};
  CHECK(bench.compared({followed, found})[0] < -1.0);
  followed.silent = true;
  CHECK(bench.compared({followed, found})[0] == 0.0);
}

TEST_CASE("a difference that the choice of elements may make is no news") {
  Bench bench;
  Hypothesis better = at_level(1.0), worse = at_level(1.0);
  better.evidence = Evidence{.share = 0.5};
  worse.evidence = Evidence{.share = 0.4};
  CHECK(bench.compared({better, worse})[0] == 0.0);
  CHECK(bench.compared({better, worse})[1] == doctest::Approx(-15.0 * (0.5 - 0.4) / 0.5));
  better.evidence->noise = 0.09;
  worse.evidence->bias = 0.12;
  CHECK(bench.compared({better, worse}) == std::vector{0.0, 0.0});
  worse.evidence->share = 0.2;
  CHECK(bench.compared({better, worse})[1] == doctest::Approx(-15.0 * 0.15 / 0.5));
  CHECK(bench.compared({worse, better})[0] == doctest::Approx(-15.0 * 0.15 / 0.5));
}

TEST_CASE("a prior may be wrong, whatever its deviations say") {
  PosePrior prior;
  prior.sigma_translation = {5.0, 5.0, 5.0};
  const auto at = [](double x) { return Pose{.translation = {x, 0.0, 0.0}}; };
  CHECK(agreement(at(0.0), prior, false) == 0.0);
  CHECK(agreement(at(10.0), prior, false) == 0.0);
  CHECK(agreement(at(15.0), prior, false) == doctest::Approx(-1.5));
  CHECK(agreement(at(25.0), prior, false) == doctest::Approx(std::log(5e-4)));
  CHECK(agreement(at(25.0), prior, true) == doctest::Approx(std::log(5e-4 / 0.03)));
  CHECK(agreement(at(1e6), prior, false) == agreement(at(25.0), prior, false));
}

TEST_CASE("a sensor hardly lies on its side, if it is known which way is up") {
  const auto tilted = [](double roll) { return pose_from_xyz_rpy({3, -2, 1}, {roll, 0, 2}); };
  const Eigen::Vector3d up(0.0, 0.0, 9.8);
  CHECK(agreement(tilted(0.0), up) == 0.0);
  CHECK(agreement(tilted(0.7), up) == 0.0);
  CHECK(agreement(tilted(-0.9), up) == doctest::Approx(std::log(5e-4)));
  CHECK(agreement(tilted(3.1), up) == doctest::Approx(std::log(5e-4)));
  CHECK(agreement(tilted(3.1), Eigen::Vector3d(-up)) == 0.0);
  CHECK(agreement(tilted(3.1), std::nullopt) == 0.0);
}
