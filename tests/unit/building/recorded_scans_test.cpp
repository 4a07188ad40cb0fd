#include "building/recorded_scans.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/engine/config.hpp"

namespace vantage::building {
namespace {

constexpr double kSpeed = 10.0;  // [m/s] towards a wall at x = 20
constexpr int kPoints = 101;
constexpr double kApart = 0.25e-3;  // of points [s]

/// A sweep of a sensor that begins at x = 0; each point is of the wall, at another height of y.
std::string sweep() {
  std::string pcd = fmt::format(
      "VERSION 0.7\nFIELDS x y z time\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH {0}\n"
      "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA ascii\n",
      kPoints);
  for (int k = 0; k < kPoints; ++k) {
    pcd += fmt::format("{} {} 0 {}\n", 20.0 - kSpeed * kApart * k, k - 50, kApart * k);
  }
  return pcd;
}

TEST_CASE("points of a recorded scan are where they were seen in the middle of its sweep") {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "scans");
  test::write_text(folder.path() / "scans/000.pcd", sweep());
  test::write_text(folder.path() / "scans/times.txt", "100\n");
  std::string poses;
  for (int k = -2; k <= 4; ++k) {
    poses += fmt::format("{} {} 0 0 0 0 0 1\n", 100.0 + 0.1 * k, kSpeed * 0.1 * k);
  }
  test::write_text(folder.path() / "poses.tum", poses);
  Config config;
  config.selector.emplace();
  config.selector->scans = folder.path() / "scans";
  config.selector->poses = folder.path() / "poses.tum";
  const auto scans = recorded_scans(config);
  REQUIRE_MESSAGE(scans, to_string(scans.error()));
  REQUIRE(scans->size() == 1);
  const LocatedScan& scan = scans->front();
  REQUIRE(scan.points.size() == kPoints);
  const double middle = kSpeed * kApart * (kPoints - 1) / 2;
  CHECK(scan.T_map_scan.translation.x() == doctest::Approx(middle));
  double most = 0.0, sum = 0.0;
  for (const Point& p : scan.points) {
    const double off = p.x() + middle - 20.0;
    most = std::max(most, std::abs(off));
    sum += off;
  }
  // Half a millisecond of way at most, and as often ahead as behind.
  CHECK(most < 0.5e-3 * kSpeed + 1e-5);
  CHECK(std::abs(sum / kPoints) < 0.05e-3 * kSpeed);
}

}  // namespace
}  // namespace vantage::building
