#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include "support/reports.hpp"
#include "vantage/kit/scene_by_viewpoint.hpp"

using namespace vantage;

namespace {

/// Sees the indices that its viewpoint's x, rounded, divides; fails below zero.
class Divisible final : public SceneByViewpoint {
 public:
  explicit Divisible(std::size_t size) : SceneByViewpoint(size), size_(size) {}
  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    const auto n = static_cast<long>(viewpoint.x());
    if (n <= 0) return fail(ErrorCode::invalid_input, "at " + std::to_string(n));
    IndexList indices;
    for (std::size_t i = 0; i < size_; i += static_cast<std::size_t>(n)) {
      indices.push_back(static_cast<std::uint32_t>(i));
    }
    return indices;
  }

 private:
  std::size_t size_;
};

}  // namespace

TEST_CASE("Eq. 10: visible_from_any is the ascending union, for any number of threads") {
  const Divisible scene(1000);
  const PointCloud viewpoints{{7, 0, 0}, {11, 0, 0}, {13, 0, 0}};
  IndexList expected;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    if (i % 7 == 0 || i % 11 == 0 || i % 13 == 0) expected.push_back(i);
  }
  for (const std::size_t threads : {1U, 2U, 4U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    CHECK(scene.visible_from_any(viewpoints).value() == expected);
  }
  CHECK(scene.visible_from_any({}).value().empty());
}

TEST_CASE("of several failing viewpoints the first is reported") {
  const Divisible scene(10);
  const PointCloud viewpoints{{7, 0, 0}, {-3, 0, 0}, {-1, 0, 0}, {-2, 0, 0}};
  for (int i = 0; i < 20; ++i) CHECK(scene.visible_from_any(viewpoints).error().message == "at -3");
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they end the program
TEST_CASE(
    "a scene of more points than memory has counters for is an error, and the program goes on") {
  const Divisible scene(std::size_t{1} << 62U);
  for (const auto& error : {scene.visible_from_any({}).error(), scene.view_counts({}).error()}) {
    CHECK(error.code == ErrorCode::internal);
    CHECK(error.message == "out of memory");
  }
}
#endif

TEST_CASE("visible_from_any reports each viewpoint, for any number of threads") {
  const Divisible scene(1000);
  const PointCloud viewpoints(100, Point(7, 0, 0));
  const IndexList expected = scene.visible({7, 0, 0}).value();
  for (const std::size_t threads : {1U, 2U, 4U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const test::Reports reports;
    CHECK(scene.visible_from_any(viewpoints, &reports).value() == expected);
    CHECK(reports.calls() == 100);
    CHECK(reports.viewpoints() == 100);
  }
  const test::Reports none;
  CHECK(scene.visible_from_any({}, &none).value().empty());
  CHECK(none.calls() == 0);
}

TEST_CASE("a viewpoint that fails is not reported as done") {
  const Divisible scene(10);
  const test::Reports reports;
  CHECK_FALSE(scene.visible_from_any(PointCloud{{7, 0, 0}, {-3, 0, 0}}, &reports));
  CHECK(reports.viewpoints() == 1);
}

TEST_CASE("view_counts tells from how many viewpoints each point is seen, for any thread count") {
  const Divisible scene(1000);
  const PointCloud viewpoints{{7, 0, 0}, {11, 0, 0}, {7, 0, 0}, {13, 0, 0}};
  ViewCounts expected;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const std::uint32_t views =
        (i % 7 == 0 ? 2U : 0U) + (i % 11 == 0 ? 1U : 0U) + (i % 13 == 0 ? 1U : 0U);
    if (views == 0) continue;
    expected.points.push_back(i);
    expected.views.push_back(views);
  }
  for (const std::size_t threads : {1U, 2U, 4U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const test::Reports reports;
    const auto counts = scene.view_counts(viewpoints, &reports);
    REQUIRE(counts);
    CHECK(counts->points == expected.points);
    CHECK(counts->views == expected.views);
    CHECK(reports.viewpoints() == 4);
  }
  CHECK(scene.view_counts({}).value().points.empty());
  CHECK(scene.view_counts(PointCloud{{7, 0, 0}, {-3, 0, 0}, {-1, 0, 0}}).error().message ==
        "at -3");
}
