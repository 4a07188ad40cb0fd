// Real scans against region maps of a real street, by the shipped configurations.
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "street.hpp"

namespace fs = std::filesystem;

namespace vantage::test {
namespace {

/// What must hold of a run over all 77 scans, here and with everything 5,000,000 m away.
void check_street(const fs::path& data, const std::string& name, double max_mean_error_m,
                  double max_mean_error_deg, bool without_ground = false) {
  const Run run = Street(data, name, {.without_ground = without_ground}).localize();
  const RunSummary s = summarize(run);
  MESSAGE(name << ": " << run.regions << " regions, " << s.tracked << "/" << s.scans << " tracked, "
               << s.count("switched") << " switches, mean " << 100 * s["error_m"].mean
               << " cm, p95 " << 100 * s["error_m"].p95 << " cm, " << s["error_deg"].mean
               << " deg, align " << s["align_ms"].mean << " ms");
  CHECK(s.scans == 77);
  CHECK(s.tracked == 77);
  CHECK(s["error_m"].count == 77);
  CHECK(s["error_m"].mean <= max_mean_error_m);
  CHECK(s["error_deg"].mean <= max_mean_error_deg);
  CHECK(s.count("far_off") == 0);
  CHECK(s.count("outside") == 0);
  if (name != "wide") {
    CHECK(s.count("switched") >= 2);
    CHECK(s["map_points"].max < 0.9 * static_cast<double>(run.map_points));
  }

  const RunSummary far = summarize(
      Street(data, name, {.shift = Point(0, 5e6, 0), .without_ground = without_ground}).localize());
  MESSAGE(name << ", 5,000 km away: mean " << 100 * far["error_m"].mean << " cm");
  CHECK(far.tracked == 77);
  CHECK(std::abs(far["error_m"].mean - s["error_m"].mean) < 1e-3);
  CHECK(std::abs(far["error_m"].max - s["error_m"].max) < 1e-3);
}

}  // namespace

TEST_CASE("kitti_street, whole map: every scan localized, also 5,000,000 m away") {
  if (const auto data = real_data("kitti_street")) check_street(*data, "wide", 0.035, 0.1);
}

TEST_CASE("kitti_street, regions of 20 m: every scan localized, also 5,000,000 m away") {
  if (const auto data = real_data("kitti_street")) check_street(*data, "L20", 0.05, 0.1);
}

TEST_CASE("kitti_street, pieces of surface: as good as the whole map, also 5,000,000 m away") {
  if (const auto data = real_data("kitti_street")) check_street(*data, "surface", 0.025, 0.1);
}

TEST_CASE("kitti_street, 20 kB a region: every scan localized, also 5,000,000 m away") {
  if (const auto data = real_data("kitti_street")) check_street(*data, "small", 0.03, 0.1);
}

TEST_CASE("kitti_street without its ground, viewpoints along the drive: every scan localized") {
  if (const auto data = real_data("kitti_street")) {
    check_street(*data, "from_trajectory", 0.06, 0.1, true);
    const StreetOptions options{.without_ground = true};
    const RunSummary whole = summarize(Street(*data, "wide", options).localize());
    MESSAGE("the whole map without ground: "
            << whole.tracked << " tracked, mean " << 100 * whole["error_m"].mean << " cm, p95 "
            << 100 * whole["error_m"].p95 << " cm, coverage " << whole["coverage"].mean);
    CHECK(whole["error_m"].mean > 0.0);
    CHECK(whole["error_m"].mean <= 0.06);
  }
}

}  // namespace vantage::test
