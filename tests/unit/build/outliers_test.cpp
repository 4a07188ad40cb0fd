#include "vantage/build/outliers.hpp"

#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "vantage/build/build.hpp"
#include "vantage/engine/config.hpp"

using namespace vantage;

namespace {

/// A rough floor of 20 x 20 m with some points high above it.
PointCloud floor_with_strays(std::uint32_t seed, int points, int strays) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  PointCloud cloud;
  for (int i = 0; i < points; ++i) {
    cloud.emplace_back(20 * uniform(), 20 * uniform(), 0.1 * uniform());
  }
  for (int i = 0; i < strays; ++i) {
    cloud.emplace_back(20 * uniform(), 20 * uniform(), 8 + 20 * uniform());
  }
  return cloud;
}

/// The definition, each distance measured.
IndexList by_definition(const PointCloud& cloud, const OutlierParams& params) {
  std::vector<double> means;
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    std::vector<double> distances;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (i != k) distances.push_back((cloud[i] - cloud[k]).norm());
    }
    std::ranges::sort(distances);
    distances.resize(std::min<std::size_t>(distances.size(), params.neighbours));
    means.push_back(std::accumulate(distances.begin(), distances.end(), 0.0) /
                    static_cast<double>(distances.size()));
  }
  const auto n = static_cast<double>(means.size());
  const double mean = std::accumulate(means.begin(), means.end(), 0.0) / n;
  double squares = 0.0;
  for (const double m : means) squares += (m - mean) * (m - mean);
  const double limit = mean + params.ratio * std::sqrt(squares / (n - 1.0));
  IndexList stay;
  for (std::uint32_t k = 0; k < means.size(); ++k) {
    if (means[k] <= limit) stay.push_back(k);
  }
  return stay;
}

TEST_CASE("outliers: what stays is what the definition says") {
  for (const auto& params :
       {OutlierParams{}, OutlierParams{.neighbours = 1, .ratio = 1.0},
        OutlierParams{.neighbours = 8, .ratio = 0.0}, OutlierParams{.neighbours = 8, .ratio = -0.5},
        OutlierParams{.neighbours = 20, .ratio = 3.0},
        OutlierParams{.neighbours = 5000, .ratio = 1.0}}) {
    for (const std::uint32_t seed : {1U, 2U, 3U}) {
      CAPTURE(params.neighbours);
      CAPTURE(params.ratio);
      const PointCloud cloud = floor_with_strays(seed, 700, 30);
      const IndexList stay = without_outliers(cloud, params);
      CHECK(stay == by_definition(cloud, params));
      CHECK(stay.size() < cloud.size());
    }
  }
}

TEST_CASE("outliers: points high above the floor go, the floor stays") {
  const PointCloud cloud = floor_with_strays(7, 4000, 20);
  const IndexList stay = without_outliers(cloud, {.neighbours = 50, .ratio = 1.0});
  CHECK(stay.size() > 3800);
  CHECK(std::ranges::none_of(stay, [](std::uint32_t k) { return k >= 4000; }));
}

TEST_CASE("outliers: the order of the points and the number of threads do not matter") {
  PointCloud cloud = floor_with_strays(11, 3000, 60);
  // Many equal distances, and points that coincide.
  for (int i = 0; i < 900; ++i) cloud.emplace_back(0.5 * (i % 30), 0.5 * (i / 30), 0.0);
  for (int i = 0; i < 90; ++i) cloud.emplace_back(3.0, 4.0, 0.05);
  const OutlierParams params{.neighbours = 12, .ratio = 0.7};
  const auto kept_of = [&](const PointCloud& points) {
    std::vector<std::array<double, 3>> kept;
    for (const std::uint32_t k : without_outliers(points, params)) {
      kept.push_back({points[k].x(), points[k].y(), points[k].z()});
    }
    std::ranges::sort(kept);
    return kept;
  };
  const auto expected = kept_of(cloud);
  CHECK(expected.size() < cloud.size());
  for (const std::size_t threads : {1U, 2U, 7U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    std::ranges::shuffle(cloud, std::mt19937(static_cast<std::uint32_t>(threads)));
    CHECK(kept_of(cloud) == expected);
  }
}

TEST_CASE(
    "outliers: equal distances stay; few points, equal points and a far origin are no error") {
  const auto stay = [](const PointCloud& cloud) { return without_outliers(cloud, {}).size(); };
  CHECK(stay({}) == 0);
  CHECK(stay({{1, 2, 3}}) == 1);
  CHECK(stay({{1, 2, 3}, {4, 5, 6}}) == 2);
  CHECK(stay(PointCloud(200, Point(1, 2, 3))) == 200);
  PointCloud ring;  // each point has the same distances to the others, but for rounding
  for (int i = 0; i < 97; ++i) {
    const double turn = 2.0 * 3.14159265358979323846 * i / 97;
    ring.emplace_back(std::cos(turn), std::sin(turn), 0.0);
  }
  CHECK(stay(ring) == 97);
  PointCloud far = floor_with_strays(5, 700, 30), near = far;
  for (Point& p : far) p += Point(0x1p20, 0x1p22, 0.0);
  for (std::size_t i = 0; i < far.size(); ++i) near[i] = far[i] - Point(0x1p20, 0x1p22, 0.0);
  CHECK(without_outliers(far, {}) == without_outliers(near, {}));
}

TEST_CASE("[ground] outliers are off unless the table is there") {
  const auto parsed = [](const std::string& ground) {
    const auto table = parse_toml("schema = 1\n[ground]\nplugin = \"pmf\"\n" + ground, "c.toml");
    REQUIRE(table);
    return parse_config(*table);
  };
  const auto off = parsed("");
  REQUIRE(off);
  CHECK_FALSE(BuildParams::from(*off).outliers);
  const auto usual = parsed("outliers = {}");
  REQUIRE_MESSAGE(usual, to_string(usual.error()));
  REQUIRE(BuildParams::from(*usual).outliers);
  CHECK(BuildParams::from(*usual).outliers->neighbours == 50);
  CHECK(BuildParams::from(*usual).outliers->ratio == 1.0);
  const auto other = parsed("outliers = { neighbours = 8, ratio = 2.5 }");
  REQUIRE(other);
  CHECK(BuildParams::from(*other).outliers->neighbours == 8);
  CHECK(BuildParams::from(*other).outliers->ratio == 2.5);
  const auto none = parsed("outliers = { neighbours = 0 }");
  REQUIRE(!none);
  CHECK(to_string(none.error()) == "c.toml:4:27: error: 'neighbours' must be in [1, 10000], not 0");
}

}  // namespace
