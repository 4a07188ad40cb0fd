// What is written is read back, and looks as the formats want it.

#include <cmath>
#include <limits>
#include <random>

#include "files.hpp"

namespace vantage {
namespace {

using io::Precision;
using test::check_clear;
using test::content_of;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

PointCloud cloud_at(const Point& middle, std::size_t count) {
  std::mt19937 random(5);
  const auto uniform = [&] { return 200.0 * static_cast<double>(random()) / 4294967296.0 - 100.0; };
  PointCloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = uniform(), y = uniform(), z = uniform();
    cloud.push_back(middle + Point(x, y, z));
  }
  return cloud;
}

std::vector<std::uint32_t> views_of(std::size_t count) {
  std::vector<std::uint32_t> views;
  for (std::size_t i = 0; i < count; ++i) views.push_back(static_cast<std::uint32_t>(i % 7 + 1));
  return views;
}

template <class T>
T value_at(const std::string& bytes, std::size_t at) {
  T value;
  REQUIRE(at + sizeof(T) <= bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

const Point kUtm(500'000.25, 4'649'776.125, 431.5);

TEST_CASE("written clouds: PCD and PLY keep doubles as they are") {
  const test::TemporaryFolder folder;
  const PointCloud cloud = cloud_at(kUtm, 5000);
  const auto views = views_of(cloud.size());
  for (const bool with_views : {false, true}) {
    const auto fields = with_views ? std::span(views) : std::span<const std::uint32_t>();
    REQUIRE(io::write_pcd(folder.path() / "a.pcd", cloud, Precision::float64, fields));
    REQUIRE(io::write_ply(folder.path() / "a.ply", cloud, Precision::float64, fields));
    CHECK(io::read_point_cloud(folder.path() / "a.pcd")->points == cloud);
    CHECK(io::read_point_cloud(folder.path() / "a.ply")->points == cloud);
  }
  const std::string ply = content_of(folder.path() / "a.ply");
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 5000\nproperty double x\n"
      "property double y\nproperty double z\nproperty uint scalar_views\nend_header\n";
  REQUIRE(ply.starts_with(header));
  CHECK(ply.size() == header.size() + 5000 * 28);
  CHECK(value_at<std::uint32_t>(ply, header.size() + 28 * 9 + 24) == views[9]);
  const std::string pcd = content_of(folder.path() / "a.pcd");
  CHECK(pcd.find("FIELDS x y z views\nSIZE 8 8 8 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 5000\n") !=
        std::string::npos);
  CHECK(value_at<std::uint32_t>(pcd, pcd.size() - 4) == views.back());
}

TEST_CASE("written clouds: float32 where it loses nothing") {
  CHECK(io::lossless_precision({}) == Precision::float32);
  CHECK(io::lossless_precision(PointCloud{{1.5, -2.25, 0.0}}) == Precision::float32);
  CHECK(io::lossless_precision(PointCloud{{1.5, 0.1, 0.0}}) == Precision::float64);
  CHECK(io::lossless_precision(PointCloud{{1e300, 0.0, 0.0}}) == Precision::float64);
  CHECK(io::lossless_precision(PointCloud{{0.1, 0.1, 0.1}}) == Precision::float64);
  CHECK(io::lossless_precision(PointCloud{{-0.0, 3.5e38, 0.0}}) == Precision::float64);
  CHECK(io::lossless_precision(PointCloud{{-0.0, 3e-38, 16777215.0}}) == Precision::float64);
  CHECK(io::lossless_precision(PointCloud{{-0.0, 16777215.0, 1e-3F}}) == Precision::float32);
  CHECK(io::lossless_precision(PointCloud{{std::nan(""), 0.0, 0.0}}) == Precision::float64);
  const test::TemporaryFolder folder;
  const PointCloud cloud{{1.5, -2.25, 0.0}, {8.0, 9.0, -10.0}};
  REQUIRE(io::write_ply(folder.path() / "a.ply", cloud, Precision::float32));
  CHECK(io::read_point_cloud(folder.path() / "a.ply")->points == cloud);
  CHECK(content_of(folder.path() / "a.ply").find("property float x") != std::string::npos);
}

TEST_CASE("written clouds: LAS is read back within half a millimetre, anywhere") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.las";
  for (const Point& middle : {Point(0, 0, 0), kUtm, Point(-3e6, 4e6, -2e6), Point(1e9, 0, 0)}) {
    const PointCloud cloud = cloud_at(middle, 3000);
    for (const bool with_views : {false, true}) {
      const auto views = with_views ? views_of(cloud.size()) : std::vector<std::uint32_t>();
      const auto written = io::write_las(path, cloud, views);
      REQUIRE_MESSAGE(written, to_string(written.error()));
      const auto back = io::read_point_cloud(path);
      REQUIRE_MESSAGE(back, to_string(back.error()));
      REQUIRE(back->points.size() == cloud.size());
      double largest = 0.0;
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        largest = std::max(largest, (back->points[i] - cloud[i]).cwiseAbs().maxCoeff());
      }
      CHECK(largest < 0.0005 + 1e-6);
      CHECK(largest > 0.0001);
    }
  }
  REQUIRE(io::write_las(path, {}));
  CHECK(io::read_point_cloud(path)->points.empty());
}

// The offsets are those of the specification, LAS 1.4 R15, counted by hand.
TEST_CASE("written clouds: the parts of a LAS file") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.las";
  const PointCloud cloud{{500000.25, 4649999.5, 10.0}, {500010.0, 4650000.0, -2.125}};
  const std::vector<std::uint32_t> views{7, 70000};
  REQUIRE(io::write_las(path, cloud, views));
  const std::string las = content_of(path);
  REQUIRE(las.size() == 375 + 54 + 192 + 2 * 34);
  CHECK(las.starts_with("LASF"));
  CHECK(value_at<std::uint16_t>(las, 6) == 16);
  CHECK(value_at<std::uint8_t>(las, 24) == 1);
  CHECK(value_at<std::uint8_t>(las, 25) == 4);
  CHECK(value_at<std::uint16_t>(las, 94) == 375);
  CHECK(value_at<std::uint32_t>(las, 96) == 375 + 54 + 192);
  CHECK(value_at<std::uint32_t>(las, 100) == 1);
  CHECK(value_at<std::uint8_t>(las, 104) == 6);
  CHECK(value_at<std::uint16_t>(las, 105) == 34);
  CHECK(value_at<std::uint32_t>(las, 107) == 0);  // the old count says nothing
  CHECK(value_at<double>(las, 131) == 0.001);
  CHECK(value_at<double>(las, 155) == 500000.0);
  CHECK(value_at<double>(las, 163) == 4650000.0);
  CHECK(value_at<double>(las, 171) == 0.0);
  CHECK(value_at<double>(las, 179) == doctest::Approx(500010.0));
  CHECK(value_at<double>(las, 187) == doctest::Approx(500000.25));
  CHECK(value_at<double>(las, 219) == doctest::Approx(-2.125));
  CHECK(value_at<std::uint32_t>(las, 243) == 0);  // extended records
  CHECK(value_at<std::uint64_t>(las, 247) == 2);
  CHECK(value_at<std::uint64_t>(las, 255) == 2);  // first returns
  CHECK(value_at<std::uint64_t>(las, 263) == 0);
  CHECK(las.substr(377, 10) == std::string("LASF_Spec\0", 10));
  CHECK(value_at<std::uint16_t>(las, 375 + 18) == 4);
  CHECK(value_at<std::uint16_t>(las, 375 + 20) == 192);
  CHECK(value_at<std::uint8_t>(las, 429 + 2) == 5);  // unsigned long
  CHECK(las.substr(429 + 4, 6) == std::string("views\0", 6));
  const std::size_t second = 621 + 34;
  CHECK(value_at<std::int32_t>(las, second) == 10000);
  CHECK(value_at<std::int32_t>(las, second + 4) == 0);
  CHECK(value_at<std::int32_t>(las, second + 8) == -2125);
  CHECK(value_at<std::uint8_t>(las, second + 14) == 0x11);  // return 1 of 1
  CHECK(value_at<std::uint32_t>(las, second + 30) == 70000);
}

TEST_CASE("written clouds: what cannot be written") {
  const test::TemporaryFolder folder;
  const PointCloud bad{{0.0, 0.0, 0.0}, {0.0, kInfinity, 0.0}};
  const PointCloud two{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};
  const std::vector<std::uint32_t> one{1};
  const auto refused = [&](const Result<void>& written, const std::string& expected) {
    REQUIRE_FALSE(written.has_value());
    check_clear(written.error(), ErrorCode::invalid_input, folder.path().string(), expected);
  };
  refused(io::write_las(folder.path() / "a.las", bad), "point 1 of 2 is (0, inf, 0)");
  refused(io::write_ply(folder.path() / "a.ply", bad, Precision::float64), "point 1 of 2");
  refused(io::write_las(folder.path() / "a.las", two, one), "1 views for 2 points");
  refused(io::write_ply(folder.path() / "a.ply", two, Precision::float32, one), "1 views");
  refused(io::write_pcd(folder.path() / "a.pcd", two, Precision::float32, one), "1 views");
  refused(io::write_las(folder.path() / "a.las", PointCloud{{-3e6, 0, 0}, {3e6, 0, 0}}),
          "points up to 3000000 m from the middle");
  refused(io::write_las(folder.path() / "a.las", PointCloud{{-1e308, 0, 0}, {1e308, 0, 0}}),
          "from the middle of the cloud");
  CHECK(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace vantage
