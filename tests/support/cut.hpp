#pragma once

#include <doctest/doctest.h>

#include <limits>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "support/plugins.hpp"
#include "vantage/conformance/range_survey.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/kit/map_in_memory.hpp"

namespace vantage::test {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

[[nodiscard]] inline const HalfOpenBox& box_of(const Partition& partition, std::uint32_t region) {
  return std::get<HalfOpenBox>(partition[RegionId{region}].footprint);
}

[[nodiscard]] inline std::vector<std::string> labels(const Partition& partition) {
  std::vector<std::string> all;
  for (const Region& region : partition.regions()) all.push_back(region.label);
  return all;
}

/// What a partitioner makes of a map in which a viewpoint sees what is within `range` [m].
[[nodiscard]] inline Result<Partition> cut(const PluginPtr<Partitioner>& partitioner,
                                           PointsView map, PointsView trajectory = {},
                                           double range = 15.0) {
  return partitioner->partition(MapInMemory(map), trajectory, conformance::RangeSurvey(map, range));
}

/// What the partitioner of this name and these parameters makes of it; an error ends the test.
[[nodiscard]] inline Partition cut_by(const std::string& name, const std::string& params,
                                      PointsView map, PointsView trajectory = {},
                                      double range = 15.0) {
  auto partition = cut(plugin<Partitioner>(name, params), map, trajectory, range);
  REQUIRE_MESSAGE(partition, to_string(partition.error()));
  return *std::move(partition);
}

/// A point in the middle of every square metre of [x0, x1) x [y0, y1).
[[nodiscard]] inline PointCloud floor(int x0, int x1, int y0, int y1,
                                      const Point& offset = Point::Zero()) {
  PointCloud points;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) points.push_back(offset + Point(x + 0.5, y + 0.5, 0.0));
  }
  return points;
}

/// n x n points on the ground from (`from`, `from`) on, `step` [m] apart.
[[nodiscard]] inline PointCloud lattice(int n, double step, double from) {
  PointCloud points;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) points.emplace_back(from + i * step, from + j * step, 0.0);
  }
  return points;
}

/// Every point of the map is in a region, and every region has one.
inline void check_every_region_owns(const Partition& partition, PointsView map) {
  std::set<std::uint32_t> owners;
  for (const Point& p : map) {
    const auto id = partition.locate(p);
    REQUIRE(id);
    owners.insert(id->value);
  }
  CHECK(owners.size() == partition.size());
}

}  // namespace vantage::test
