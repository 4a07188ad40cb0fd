#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "vantage/build/viewpoints.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::benchmarks {

/// On the recorded street: near the first pose of the drive, amid it, at its end, and above the
/// roofs.
inline const std::array kStreetViewpoints{Point(0.34, 0.01, 0.0), Point(30.0, 2.0, 0.0),
                                          Point(63.97, 9.27, -0.53), Point(30.0, 2.0, 40.0)};

/// @return  the map of the recorded street [m]; nothing where the recorded data is absent
[[nodiscard]] Result<std::optional<PointCloud>> street();

[[nodiscard]] Result<PointCloud> read_map(const std::filesystem::path& file);

/// The map that `vantage simulate configs/simulate/campus200.toml` writes, with another size: so
/// the density is the same.
/// @param size  edge of the campus [m]
[[nodiscard]] Result<PointCloud> campus(double size);

/// Viewpoints over the ground that `pmf` finds, as a build places them (Eqs. 4-5).
[[nodiscard]] Result<PointCloud> viewpoints_over_ground(PointsView map,
                                                        const ViewpointParams& params);

/// Every n-th, so that `size` remain; all if there are no more than that.
template <class T>
[[nodiscard]] std::vector<T> thinned(const std::vector<T>& from, std::size_t size) {
  if (from.size() <= size) return from;
  std::vector<T> kept;
  for (std::size_t i = 0; i < size; ++i) kept.push_back(from[i * from.size() / size]);
  return kept;
}

}  // namespace vantage::benchmarks
