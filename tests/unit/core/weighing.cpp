#include "localize/weighing.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "fakes.hpp"

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
  PluginPtr<MapStore> store =
      test::in_process<test::MemoryStore, MapStore>(std::make_shared<test::Memory>());
  PluginPtr<ScanMatcher> matcher =
      test::in_process<test::TruthMatcher, ScanMatcher>(std::make_shared<test::Truth>());
  RegionMaps maps{store, matcher, {.memory = 1, .background = false}};
  Weighing weighing{*matcher, maps, ShareModel{}, {.metres = 0.5, .radians = 0.05}};

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

TEST_CASE("a proven pose is not preferred less where the scan shows nothing that is sharp") {
  Bench bench;
  bench.track(1.2, 0.01);
  Hypothesis followed = at_level(1.2), found = at_level(1.1);
  followed.evidence = Evidence{.share = 0.0, .noise = 0.01};
  found.evidence = Evidence{.share = 0.3, .noise = 0.01};
  CHECK(bench.weighing.compare({followed, found})[0] < -1.0);
  followed.proven = true;
  CHECK(bench.weighing.compare({followed, found})[0] == 0.0);
  followed.alignment->score.nvtl = 0.6;  // it scores worse than before: the sensor is elsewhere
  CHECK(bench.weighing.compare({followed, found})[0] < -1.0);
}

TEST_CASE("a difference that the choice of elements may make is no news") {
  Bench bench;
  Hypothesis better = at_level(1.0), worse = at_level(1.0);
  better.evidence = Evidence{.share = 0.5, .noise = 0.01};
  worse.evidence = Evidence{.share = 0.4, .noise = 0.01};
  CHECK(bench.weighing.compare({better, worse}) == std::vector{0.0, -15.0 * (0.5 - 0.4) / 0.5});
  better.evidence->bias = 0.09;
  worse.evidence->bias = 0.12;
  CHECK(bench.weighing.compare({better, worse}) == std::vector{0.0, 0.0});
  worse.evidence->share = 0.2;
  CHECK(bench.weighing.compare({better, worse})[1] == doctest::Approx(-15.0 * 0.15 / 0.5));
  CHECK(bench.weighing.compare({worse, better})[0] == doctest::Approx(-15.0 * 0.15 / 0.5));
}

TEST_CASE("a prior may be wrong, whatever its deviations say") {
  PosePrior prior;
  prior.sigma_translation = {5.0, 5.0, 5.0};
  const auto at = [](double x) { return Pose{.translation = {x, 0.0, 0.0}}; };
  CHECK(agreement(at(0.0), prior) == 0.0);
  CHECK(agreement(at(10.0), prior) == 0.0);
  CHECK(agreement(at(15.0), prior) == doctest::Approx(-1.5));
  CHECK(agreement(at(25.0), prior) == doctest::Approx(std::log(1e-3)));
  CHECK(agreement(at(1e6), prior) == agreement(at(25.0), prior));
}
