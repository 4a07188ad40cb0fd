#include "localize/evidence.hpp"

#include <doctest/doctest.h>

#include "localize/contrast.hpp"
#include "support/fakes.hpp"
#include "vantage/kit/evenly_picked.hpp"

using namespace vantage;

TEST_CASE("a sharper fit speaks for a pose, a flat one against it, within bounds") {
  double before = -100.0;
  for (double share = 0.0; share <= 1.2; share += 0.02) {
    const double ratio = log_likelihood_ratio({share, 0.0});
    CHECK(ratio >= before - 0.5);  // grows, but for the step where any right pose begins
    CHECK(ratio >= -6.0);
    CHECK(ratio <= 9.3);
    before = ratio;
  }
  CHECK(log_likelihood_ratio({0.0, 0.0}) < -3.0);
  CHECK(log_likelihood_ratio({-0.5, 0.0}) == log_likelihood_ratio({0.0, 0.0}));
  CHECK(log_likelihood_ratio({.share = 0.8, .noise = 0.0, .margin = 0.3}) > 6.0);
}

TEST_CASE("a scan without structure says nothing") {
  const double told = log_likelihood_ratio({0.0, 0.0});
  const double untold = log_likelihood_ratio({0.0, 1.0});
  CHECK(std::abs(untold) < 0.1 * std::abs(told));
  CHECK(log_likelihood_ratio({0.5, 1.0}) < 0.3 * log_likelihood_ratio({0.5, 0.0}));
  const Evidence flat =
      evidence_of({.level = 1.0}, {.level = 1.0, .noise = 0.01, .sharpness = 0.0});
  CHECK(flat.noise > 1.0);
}

TEST_CASE("the less of a scan was compared, the less a share says for a pose") {
  const Fit whole{.level = 1.0, .sharpness = 0.3};
  Fit part = whole;
  part.compared = 0.2;
  const Fit to_itself{.level = 1.0, .sharpness = 1.0};
  const Evidence all = evidence_of(whole, to_itself), some = evidence_of(part, to_itself);
  CHECK(all.bias == 0.0);
  CHECK(some.bias > 0.1);
  CHECK(some.share == all.share);
  CHECK(some.noise == all.noise);
  CHECK(log_likelihood_ratio(some) < 0.3 * log_likelihood_ratio(all));
  // No sharpness speaks against a pose all the same, and a perfect fit speaks for it.
  CHECK(log_likelihood_ratio({0.0, some.noise, some.bias}) < -2.0);
  CHECK(log_likelihood_ratio({1.0, some.noise, some.bias}) > 4.0);
}

TEST_CASE("sharpness is what is lost 2 m beside, along the weakest axis") {
  /// Along a wall parallel to x, sliding costs nothing.
  class Wall final : public MatchTarget {
   public:
    [[nodiscard]] Result<Alignment> align(PointsView, const Pose&) const noexcept override {
      return fail(ErrorCode::unsupported, "");
    }
    [[nodiscard]] Result<ScanScore> score(PointsView, const Pose& pose) const noexcept override {
      const double off = std::abs(pose.translation.y()) + slope * std::abs(pose.translation.x());
      return ScanScore{.fitness = 0.0,
                       .nvtl = 2.0 * std::exp(-off),
                       .coverage = 0.5,
                       .compared = pose.translation == Point::Zero() ? 0.25 : 0.75};
    }
    [[nodiscard]] std::size_t bytes() const noexcept override { return 0; }
    [[nodiscard]] std::size_t elements() const noexcept override { return 1; }
    double slope = 0.0;
  } target;
  const PointCloud scan{{1, 0, 0}};
  const Fit along = fit_at(target, scan, Pose{}).value();
  CHECK(along.level == doctest::Approx(1.0));
  CHECK(along.sharpness == doctest::Approx(0.0));
  CHECK(along.compared == 0.25);  // not what is compared beside
  target.slope = 1.0;
  CHECK(fit_at(target, scan, Pose{})->sharpness == doctest::Approx(1.0 - std::exp(-2.0)));
}

TEST_CASE("a sensor that is mounted at a tilt is compared with poses beside it at its height") {
  /// A ground that a scan fits at its own height only.
  class Ground final : public MatchTarget {
   public:
    [[nodiscard]] Result<Alignment> align(PointsView, const Pose&) const noexcept override {
      return fail(ErrorCode::too_few_matches, "");
    }
    [[nodiscard]] Result<ScanScore> score(PointsView, const Pose& pose) const noexcept override {
      const double off = 5.0 * std::abs(pose.translation.z());
      return ScanScore{.fitness = 0.0, .nvtl = std::exp(-off), .coverage = 1.0};
    }
    [[nodiscard]] std::size_t bytes() const noexcept override { return 0; }
    [[nodiscard]] std::size_t elements() const noexcept override { return 1; }
  } ground;
  const PointCloud scan{{1, 0, 0}};
  for (const Eigen::Vector3d& tilt :
       {Eigen::Vector3d(0.3, 0.26, 0.0), Eigen::Vector3d(0.4, 0.3, 2.0),
        Eigen::Vector3d(0.0, 1.570796326794897, 0.0)}) {
    const Pose pose = pose_from_xyz_rpy({}, tilt);
    CHECK(fit_at(ground, scan, pose)->sharpness == doctest::Approx(0.0));
    const Evidence evidence{.share = 1.0, .sharpness = 1.0};
    const auto contrast = contrast_at(ground, scan, pose, 0.5, evidence).value();
    CHECK(contrast.value().slope == doctest::Approx(0.0));  // all places beside it are as good
  }
  const Eigen::Matrix3d level = level_axes(up_of(Pose{}));
  CHECK(level == Eigen::Matrix3d::Identity());
}

TEST_CASE("the margin is negative where the scan fits better at the alert limit than at the pose") {
  /// Fits best at `best`, and at any place along z and any roll and pitch alike.
  class Valley final : public MatchTarget {
   public:
    [[nodiscard]] Result<Alignment> align(PointsView, const Pose&) const noexcept override {
      return fail(ErrorCode::unsupported, "");
    }
    [[nodiscard]] Result<ScanScore> score(PointsView, const Pose& pose) const noexcept override {
      const Point ahead = pose.rotation.toRotationMatrix() * Point::UnitX();
      const double turned = std::atan2(ahead.y(), ahead.x()) - best_heading;
      const double off =
          (pose.translation - best).head<2>().squaredNorm() + 100.0 * turned * turned;
      return ScanScore{.fitness = 0.0, .nvtl = std::exp(-off), .coverage = 1.0};
    }
    [[nodiscard]] std::size_t bytes() const noexcept override { return 0; }
    [[nodiscard]] std::size_t elements() const noexcept override { return 1; }
    Point best = Point::Zero();
    double best_heading = 0.0;
  } target;
  const PointCloud scan(400, Point{1, 0, 0});
  const AlertLimit limit{.metres = 0.5, .radians = 0.05};
  const auto margin = [&] { return fit_at(target, scan, Pose{}, limit)->margin; };
  CHECK(fit_at(target, scan, Pose{})->margin == 0.0);  // not asked for
  CHECK(margin() == doctest::Approx(0.0));             // open along z
  CHECK(fit_at(target, scan, Pose{}, limit)->margin_noise == doctest::Approx(0.3 / 16.0));
  target.best = {0.0, 0.5, 0.0};
  CHECK(margin() == doctest::Approx(1.0 - std::exp(0.25)));
  target.best = Point::Zero();
  target.best_heading = -0.05;
  CHECK(margin() == doctest::Approx(1.0 - std::exp(0.25)));
}

TEST_CASE("a margin below its noise speaks against a pose, however sharp it is") {
  Evidence evidence{.share = 0.8, .margin = 0.3, .margin_noise = 0.03};
  const double right = log_likelihood_ratio(evidence);
  CHECK(right > 6.0);
  evidence.margin = 0.0;
  CHECK(log_likelihood_ratio(evidence) == right);
  evidence.margin = -0.3;
  CHECK(log_likelihood_ratio(evidence) < -3.0);
  evidence.bias = 0.3;  // of a map that could not be compared
  CHECK(log_likelihood_ratio(evidence) >= 0.0);
}

TEST_CASE("points are picked evenly, and no more than there are") {
  const PointCloud points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  CHECK(evenly_picked(points, 2).size() == 2);
  CHECK(evenly_picked(points, 2)[1].x() == 2.0);
  CHECK(evenly_picked(points, 9).size() == 4);
  CHECK(evenly_picked({}, 9).empty());
}
