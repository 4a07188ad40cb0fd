// Open3D's HiddenPointRemoval, as the plugin `hpr_open3d`, is the reference for the flip kernel.
#include <doctest/doctest.h>
#include <unistd.h>

#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>

#include "scenes.hpp"
#include "support/plugins.hpp"

namespace vantage::test {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

Result<IndexList> seen_by(const char* plugin_name, PointsView map, const Point& viewpoint,
                          const std::string& params, double max_range = kUnlimited) {
  const auto visibility = plugin<VisibilityOperator>(plugin_name, params);
  VANTAGE_TRY(const auto scene,
              visibility->prepare(map, {.map_bounds = bounds_of(map), .max_range = max_range}));
  return scene->visible(viewpoint);
}

/// @return  how many points both see
std::size_t check_equal(PointsView map, const Point& viewpoint, double alpha,
                        double max_range = kUnlimited) {
  const std::string params = "alpha = " + std::to_string(alpha);
  CAPTURE(params);
  const auto ours = seen_by("hpr", map, viewpoint, params, max_range);
  const auto reference = seen_by("hpr_open3d", map, viewpoint, params, max_range);
  REQUIRE_MESSAGE(ours, to_string(ours.error()));
  REQUIRE_MESSAGE(reference, to_string(reference.error()));
  CHECK(*ours == *reference);
  return reference->size();
}

/// What is written to stderr, by whatever library, as long as the object lives.
class CapturedStderr {
 public:
  CapturedStderr() : file_(std::tmpfile()), kept_(dup(STDERR_FILENO)) {
    REQUIRE(file_ != nullptr);
    dup2(fileno(file_), STDERR_FILENO);
  }
  ~CapturedStderr() {
    dup2(kept_, STDERR_FILENO);
    close(kept_);
    std::fclose(file_);
  }
  CapturedStderr(const CapturedStderr&) = delete;
  CapturedStderr& operator=(const CapturedStderr&) = delete;
  [[nodiscard]] long bytes() const { return lseek(fileno(file_), 0, SEEK_END); }

 private:
  std::FILE* file_;
  int kept_;
};

TEST_CASE("hpr equals Open3D on 50,000 points of the recorded street") {
  const auto& map = street();
  if (!map) return;
  const PointCloud cloud = thinned(*map, 50000);
  for (const Point& viewpoint :
       {Point(0.34, 0.01, 0.0), Point(15.0, 1.0, -0.7), Point(63.97, 9.27, -0.53)}) {
    for (const double alpha : {1.0, 100.0, 1000.0}) {
      const std::size_t seen = check_equal(cloud, viewpoint, alpha);
      CHECK(seen > 200);
      CHECK(seen < cloud.size());
    }
    CHECK(check_equal(cloud, viewpoint, 100.0, 20.0) > 100);
  }
}

TEST_CASE("hpr equals Open3D on a random cloud") {
  const PointCloud cloud = ball(11, 5000, 20.0, 0.5);
  const Point viewpoint(0.1, -0.2, 0.15);
  CHECK(check_equal(cloud, viewpoint, 10.0) > 100);
  CHECK(check_equal(cloud, viewpoint, 10.0, 12.0) > 100);
}

TEST_CASE("hpr equals Open3D with points at the viewpoint and several at one place") {
  const PointCloud once = ball(12, 2000, 20.0, 0.5);
  const PointCloud cloud = joined(once, thinned(once, 500));
  CHECK(check_equal(cloud, cloud.front(), 100.0) > 100);
  CHECK(check_equal(cloud, cloud.front() + Point(0.0, 1e-155, 0.0), 100.0) > 100);

  const Point viewpoint(0.1, -0.2, 0.15);
  const auto all = seen_by("hpr_open3d", cloud, viewpoint, "alpha = 100.0");
  const auto of_one_copy = seen_by("hpr_open3d", once, viewpoint, "alpha = 100.0");
  REQUIRE(all);
  REQUIRE(of_one_copy);
  CHECK(all->size() > of_one_copy->size());
}

TEST_CASE("parameters of hpr_open3d") {
  const auto refusal = [](const std::string& params) -> std::string {
    try {
      (void)plugin<VisibilityOperator>("hpr_open3d", params);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return {};
  };
  CHECK(refusal("").empty());
  CHECK(refusal("alpha = 1").empty());
  CHECK(refusal("alpha = 0.5").find("alpha") != std::string::npos);
  CHECK(refusal("alpha = 1e7").find("alpha") != std::string::npos);
  CHECK(refusal("kernel = \"inversion\"").find("kernel") != std::string::npos);
}

TEST_CASE("hpr_open3d: alpha is 100 if left out") {
  const PointCloud cloud = ball(13, 2000, 20.0, 0.5);
  const auto left_out = seen_by("hpr_open3d", cloud, Point::Zero(), "");
  REQUIRE(left_out);
  CHECK(*left_out == *seen_by("hpr_open3d", cloud, Point::Zero(), "alpha = 100.0"));
  CHECK(*left_out != *seen_by("hpr_open3d", cloud, Point::Zero(), "alpha = 1.0"));
}

TEST_CASE("hpr_open3d: where Open3D makes no hull there is an error, and nothing is printed") {
  const auto flat = plugin<VisibilityOperator>("hpr");  // what it loads of Qhull is the other's too
  const auto check_refused = [](const PointCloud& map, const Point& viewpoint) {
    CAPTURE(map.size());
    const CapturedStderr printed;
    const auto seen = seen_by("hpr_open3d", map, viewpoint, "");
    REQUIRE_FALSE(seen);
    CHECK(seen.error().code == ErrorCode::invalid_input);
    CHECK(seen.error().message.find("lie in one plane") != std::string::npos);
    CHECK(seen.error().message.find('\n') == std::string::npos);
    CHECK(printed.bytes() == 0);
  };
  check_refused({{1, 2, 3}, {3, 4, 5}}, Point::Zero());                    // too few
  check_refused({{1, 2, 0}, {3, 4, 0}, {3, -4, 0}}, Point::Zero());        // a plane
  check_refused({{0, 0, 1}, {0, 0, 2}, {0, 0, 3}, {0, 0, 4}}, {0, 0, 9});  // a line
  check_refused(wall(5.0, 10, 0.1), {5.0, 0.01, 0.02});                    // a plane across x

  // A disc 1e-13 m thick, of which Qhull would say that its first tetrahedron is narrow.
  PointCloud disc = ball(14, 2000, 10.0);
  for (Point& p : disc) p.z() *= 1e-14;
  check_refused(disc, Point::Zero());
}

TEST_CASE("hpr_open3d: no points in reach, and points at one place") {
  const PointCloud map{{1, 2, 3}, {1, 2, 3}, {5, 6, 7}};
  CHECK(*seen_by("hpr_open3d", map, {100, 0, 0}, "", 1.0) == IndexList{});
  CHECK(*seen_by("hpr_open3d", map, {1, 2, 2}, "", 2.0) == IndexList{0, 1});
}

TEST_CASE("hpr_open3d: a radius that is too small is an error") {
  const PointCloud cloud = ball(15, 200, 1.0);
  const auto far = seen_by("hpr_open3d", cloud, {1000, 0, 0}, "alpha = 1.0");
  REQUIRE_FALSE(far);
  CHECK(far.error().code == ErrorCode::invalid_input);
  CHECK(far.error().message.find("raise alpha") != std::string::npos);

  const PointCloud wide{{-1e9, 0, 0}, {1e9, 0, 0}};
  const auto prepared =
      plugin<VisibilityOperator>("hpr_open3d", "alpha = 1e4")->prepare(wide, {bounds_of(wide)});
  REQUIRE_FALSE(prepared);
  CHECK(prepared.error().message.find("at most 1e12 m") != std::string::npos);
}

}  // namespace
}  // namespace vantage::test
