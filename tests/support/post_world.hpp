#pragma once

#include <doctest/doctest.h>

#include <memory>
#include <optional>

#include "support/fakes.hpp"
#include "support/plugins.hpp"
#include "vantage/conformance/range_survey.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/kit/map_in_memory.hpp"

namespace vantage::test {

/// Posts of different heights beside the strips; no two places are alike.
inline PointCloud posts() {
  PointCloud points;
  for (int i = 0; i < 60; ++i) {
    const double x = 40.0 * ((i * 37) % 60) / 60.0 - 5.0, y = 30.0 * ((i * 23) % 60) / 60.0 - 15.0;
    for (double z = 0.2; z < 1.5 + i % 7; z += 0.4) points.emplace_back(x, y, z);
  }
  return points;
}

/// Three strips of 10 m along x; with a gap, strip 1 has no map.
struct PostWorld {
  std::shared_ptr<Memory> memory = std::make_shared<Memory>();
  std::shared_ptr<Truth> truth = std::make_shared<Truth>();
  PointCloud posts_of_map = posts();
  PointCloud scan{{5, 0, 0}, {6, 0, 0}, {0, 7, 1}};

  explicit PostWorld(bool gap = false) {
    truth->scan = scan;
    const Partition partition =
        Strips(3).partition(MapInMemory({}), {}, conformance::RangeSurvey({}, 1.0)).value();
    const auto writer =
        MemoryStore(memory).begin({partition, {}, {{0, -100, 0}, {30, 100, 5}}, 100, ""}).value();
    for (std::uint32_t r = 0; r < 3; ++r) {
      RegionMap map;
      if (!(gap && r == 1)) map.points = posts_of_map;
      for (int x = 0; x < 10; ++x) map.viewpoints.emplace_back(10.0 * r + x + 0.5, 0, 1);
      REQUIRE(writer->put(RegionId{r}, map));
    }
    REQUIRE(std::move(*writer).commit());
  }

  [[nodiscard]] Localizer localizer(const LocalizerParams& params = {}) const {
    auto opened =
        Localizer::open(bundle_in(memory).value(), in_process<TruthMatcher, ScanMatcher>(truth),
                        plugin<Relocalizer>("voxel_search"), params);
    REQUIRE_MESSAGE(opened, to_string(opened.error()));
    return *std::move(opened);
  }

  /// Moves the truth, and the scan with it.
  void stand_at(const Pose& T_map_scan) {
    truth->T_map_scan = T_map_scan;
    scan.clear();
    for (const Point& p : posts_of_map) scan.push_back(T_map_scan.inverse() * p);
    truth->scan = scan;
  }

  /// Localizes what is seen from a pose.
  ScanReport look(Localizer& localizer, double stamp, const Pose& T_map_scan,
                  const std::optional<Pose>& odometry = {}) {
    stand_at(T_map_scan);
    if (odometry) REQUIRE(localizer.add(OdometrySample{stamp, *odometry}));
    auto report = localizer.localize({.stamp = stamp, .points = scan});
    REQUIRE_MESSAGE(report, to_string(report.error()));
    return *std::move(report);
  }

  /// Moves the truth to x and localizes a scan there.
  ScanReport at(Localizer& localizer, double stamp, double x,
                std::optional<Pose> odometry = {}) const {
    truth->T_map_scan.translation = {x, 0, 0};
    if (odometry) REQUIRE(localizer.add(OdometrySample{stamp, *odometry}));
    auto report = localizer.localize({.stamp = stamp, .points = scan});
    REQUIRE_MESSAGE(report, to_string(report.error()));
    return *std::move(report);
  }
};

inline Pose at_x(double x) { return pose_from_xyz_rpy({x, 0, 0}, {0, 0, 0}); }

}  // namespace vantage::test
