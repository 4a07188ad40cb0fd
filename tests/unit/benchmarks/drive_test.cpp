#include "drive.hpp"

#include <doctest/doctest.h>

namespace vantage::benchmarks {
namespace {

/// Straight on with 2 m a tenth of a second, the last step twice as long.
std::vector<Frame> straight() {
  std::vector<Frame> frames;
  for (const double stamp : {0.0, 0.1, 0.2, 0.4}) {
    frames.push_back({stamp, {}, pose_from_xyz_rpy({20.0 * stamp, 0.0, 0.0}, Point::Zero())});
  }
  return frames;
}

TEST_CASE("poses are predicted with constant velocity, whatever the time between scans") {
  const auto frames = straight();
  std::vector<Pose> guesses;
  const DriveErrors errors = follow(frames, [&](PointsView, const Pose& guess) -> Result<Pose> {
    guesses.push_back(guess);
    return frames[guesses.size() - 1].T_map_scan;
  });
  REQUIRE(guesses.size() == 4);
  CHECK(guesses[0].translation.x() == doctest::Approx(0.0));  // the reference
  CHECK(guesses[1].translation.x() == doctest::Approx(0.0));  // nothing known of the velocity
  CHECK(guesses[2].translation.x() == doctest::Approx(4.0));
  CHECK(guesses[3].translation.x() == doctest::Approx(8.0));
  CHECK(errors.failed == 0);
  for (const double centimetres : errors.centimetres) CHECK(centimetres == doctest::Approx(0.0));
}

TEST_CASE("a scan that fails keeps the predicted pose and counts") {
  const auto frames = straight();
  const DriveErrors errors = follow(frames, [](PointsView, const Pose&) -> Result<Pose> {
    return fail(ErrorCode::too_few_matches, "none");
  });
  CHECK(errors.failed == 4);
  REQUIRE(errors.centimetres.size() == 4);
  CHECK(errors.centimetres[3] == doctest::Approx(800.0));
}

TEST_CASE("errors are in centimetres and degrees") {
  const PoseError error = error_of(pose_from_xyz_rpy({0.03, 0.04, 0.0}, {0.0, 0.0, 0.1}), Pose{});
  CHECK(error.centimetres == doctest::Approx(5.0));
  CHECK(error.degrees == doctest::Approx(5.7296).epsilon(1e-4));
}

}  // namespace
}  // namespace vantage::benchmarks
