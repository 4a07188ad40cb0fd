#pragma once

#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "files.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/tiling.hpp"

namespace vantage::test {

/// Points around 0 on a grid of 1/64 m, so that many are on the borders of cells, in random order.
inline PointCloud scattered(std::size_t count, unsigned seed, double half_side = 40.0) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> place(-static_cast<int>(64 * half_side),
                                           static_cast<int>(64 * half_side));
  PointCloud points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = place(random) / 64.0;
    const double y = place(random) / 64.0;
    points.emplace_back(i % 3 == 0 ? 5.0 * std::round(x / 5.0) : x, y, static_cast<double>(i));
  }
  return points;
}

/// What canonical order means, by a stable sort in memory.
/// The canonical order as its definition says it, bit by bit.
inline PointCloud in_canonical_order(PointCloud points) {
  const auto key = [](const Point& p) {
    const Eigen::Vector3d cell = (p / 5.0).array().floor();
    const Eigen::Vector3d place = ((p - 5.0 * cell) * (1024.0 / 5.0)).array().floor();
    long curve = 0;
    for (int bit = 9; bit >= 0; --bit) {
      for (const int axis : {2, 1, 0}) {
        curve = 2 * curve + (static_cast<long>(place[axis]) >> bit) % 2;
      }
    }
    return std::tuple(cell.y(), cell.x(), cell.z(), curve, p.x(), p.y(), p.z());
  };
  std::stable_sort(points.begin(), points.end(),
                   [&](const Point& a, const Point& b) { return key(a) < key(b); });
  return points;
}

inline PointCloud within(const PointCloud& points, const io::CellRectangle& cells) {
  PointCloud inside;
  for (const Point& p : points) {
    const double x = std::floor(p.x() / 5.0);
    const double y = std::floor(p.y() / 5.0);
    if (x >= static_cast<double>(cells.min_x) && x < static_cast<double>(cells.max_x) &&
        y >= static_cast<double>(cells.min_y) && y < static_cast<double>(cells.max_y)) {
      inside.push_back(p);
    }
  }
  return inside;
}

/// The files of a folder and what they contain.
inline std::map<std::string, std::string> files_of_map(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files[entry.path().filename().string()] = content_of(entry.path());
  }
  return files;
}

/// Options for little maps, of which everything happens often.
inline io::TilingOptions little(const std::filesystem::path& out) {
  return {
      .out = out, .memory = std::uint64_t{5} << 20U, .pack_size = 4000, .checkpoint_points = 5000};
}

inline io::TilingReport tiled(const std::vector<std::filesystem::path>& files,
                              const io::TilingOptions& options) {
  const auto report = io::tile_clouds(files, options);
  REQUIRE_MESSAGE(report, to_string(report.error()));
  return *report;
}

inline io::TiledMap opened(const std::filesystem::path& folder) {
  auto map = io::TiledMap::open(folder);
  REQUIRE_MESSAGE(map, to_string(map.error()));
  return *std::move(map);
}

}  // namespace vantage::test
