#include "localize/contrast.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

using namespace vantage;

namespace {

constexpr double kLimit = 0.5;

/// A scan fits at a few places, each 0.3 m wide by default, and better at one height, where its
/// ground is. Matching comes to the place that is nearest.
class Places final : public MatchTarget {
 public:
  /// @param fit_of_ground  how much better a scan fits with its ground at z = `ground`
  explicit Places(std::vector<std::pair<Eigen::Vector2d, double>> places, double ground = 0.0,
                  double fit_of_ground = 0.0, double width = 0.3)
      : places_(std::move(places)), ground_(ground), fit_of_ground_(fit_of_ground), width_(width) {}
  [[nodiscard]] Result<Alignment> align(PointsView points,
                                        const Pose& start) const noexcept override {
    const Eigen::Vector2d from = start.translation.head<2>();
    const auto nearest = std::ranges::min_element(
        places_, {}, [&](const auto& place) { return (place.first - from).norm(); });
    if ((nearest->first - from).norm() > 2.0 * width_) return fail(ErrorCode::too_few_matches, "");
    Alignment alignment;
    alignment.T_map_scan = start;
    alignment.T_map_scan.translation.head<2>() = nearest->first;
    alignment.score = score(points, alignment.T_map_scan).value();
    return alignment;
  }
  [[nodiscard]] Result<ScanScore> score(PointsView, const Pose& pose) const noexcept override {
    const double above = (pose.translation.z() - ground_) / 0.05;
    double level = 0.2 + fit_of_ground_ * std::exp(-0.5 * above * above);
    for (const auto& [at, height] : places_) {
      const double off = (pose.translation.head<2>() - at).norm() / width_;
      level += height * std::exp(-0.5 * off * off);
    }
    return ScanScore{.fitness = 0.0, .nvtl = level, .coverage = 1.0};
  }
  [[nodiscard]] std::size_t bytes() const noexcept override { return 0; }
  [[nodiscard]] std::size_t elements() const noexcept override { return 1; }

 private:
  std::vector<std::pair<Eigen::Vector2d, double>> places_;
  double ground_, fit_of_ground_, width_;
};

/// @param share  of the scan at the pose, which is the origin
Contrast contrast_of(const Places& target, double share = 1.0) {
  const PointCloud scan(400, Point{1, 0, 0});
  return *contrast_at(target, scan, Pose{}, kLimit, {.share = share, .sharpness = 1.0}).value();
}

}  // namespace

TEST_CASE("the contrast is what a scan loses at the best other summit, and on the best slope") {
  const double beside = std::exp(-0.5 * std::pow(kLimit / 0.3, 2.0));
  const Contrast alone = contrast_of(Places({{{0.0, 0.0}, 1.0}}));
  CHECK(alone.summit == 1.0);
  // The climbs stop within a fifth of a metre of the limit.
  CHECK(alone.slope >= 1.0 - beside - 1e-9);
  CHECK(alone.slope < 1.0);
  CHECK(ratio_of_twin(alone) < 1e-3);

  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.5, 0.5), Eigen::Vector2d(-1.2, 0.05),
                                    Eigen::Vector2d(0.9, -1.7), Eigen::Vector2d(0.0, 1.83)}) {
    const Contrast twin = contrast_of(Places({{{0.0, 0.0}, 1.0}, {at, 1.0}}));
    CHECK(std::abs(twin.summit) < 0.1);
    CHECK(twin.slope <= twin.summit);
    CHECK(ratio_of_twin(twin) > 100.0);
    const Contrast worse = contrast_of(Places({{{0.0, 0.0}, 1.0}, {at, 0.3}}));
    CHECK(worse.summit > 0.5);
    const Contrast better = contrast_of(Places({{{0.0, 0.0}, 1.0}, {at, 1.5}}));
    CHECK(better.summit < -0.3);
    CHECK(ratio_of_twin(better) > 0.9 * ratio_of_twin(twin));
  }
  // Too near to each other for two summits.
  const Contrast merged = contrast_of(Places({{{0.0, 0.0}, 1.0}, {{0.52, 0.0}, 0.98}}));
  CHECK(merged.slope < 0.1);
  CHECK(ratio_of_twin(merged) > 100.0);
}

TEST_CASE("a twin has no contrast, however exactly a scan has to be there") {
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.85, 0.85), Eigen::Vector2d(-1.23, 0.06)}) {
    const Contrast twin =
        contrast_of(Places({{{0.0, 0.0}, 1.0}, {at, 1.0}}, 0.0, 0.0, /*width=*/0.06));
    CHECK(twin.summit == doctest::Approx(0.0));
    CHECK(ratio_of_twin(twin) > 100.0);
  }
}

TEST_CASE("a scan that fits better at another height has no contrast") {
  for (const double ground : {-4.6, -1.9, -0.72, 0.55, 0.81, 1.4, 3.3}) {
    CAPTURE(ground);
    const Contrast off = contrast_of(Places({{{0.0, 0.0}, 1.0}}, ground, 0.4));
    CHECK(off.summit < -0.2);
    CHECK(ratio_of_twin(off) > 100.0);
  }
  // The right height, or one that counts as the same.
  for (const double ground : {0.0, 0.3, -0.4}) {
    CHECK(contrast_of(Places({{{0.0, 0.0}, 1.0}}, ground, 0.4)).summit == 1.0);
  }
}

TEST_CASE("what is nearer than the limit is the same pose") {
  const Contrast near = contrast_of(Places({{{0.0, 0.0}, 1.0}, {{0.2, 0.1}, 1.0}}));
  CHECK(near.summit == 1.0);
}

TEST_CASE("a contrast says less where the world has changed or the scan has no structure") {
  const Places twins({{{0.0, 0.0}, 1.0}, {{1.0, 1.0}, 1.0}});
  CHECK(contrast_of(twins, 0.3).noise > 3.0 * contrast_of(twins).noise);
  CHECK(ratio_of_twin(contrast_of(twins, 0.2)) < 0.05 * ratio_of_twin(contrast_of(twins)));
  CHECK(weight_of(contrast_of(twins, 0.2)) < 0.5 * weight_of(contrast_of(twins)));
  const PointCloud scan(400, Point{1, 0, 0});
  CHECK_FALSE(contrast_at(twins, scan, Pose{}, kLimit, {}).value().has_value());
}

TEST_CASE("the better the contrast, the less probable is a twin") {
  for (const double noise : {0.02, 0.1, 0.5, 2.0}) {
    double before = 1e9;
    for (double value = -1.0; value <= 1.0; value += 0.01) {
      const double ratio = ratio_of_twin({value, value, noise});
      CHECK(ratio <= before + 1e-12);
      before = ratio;
    }
  }
  CHECK(ratio_of_twin({0.0, 0.0, 5.0}) == doctest::Approx(1.0).epsilon(0.1));
}
