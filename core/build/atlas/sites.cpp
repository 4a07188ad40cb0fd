#include "build/atlas/sites.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>

#include "vantage/kit/hash.hpp"

namespace vantage {
namespace {

/// Viewpoint v of region r.
struct ViewpointOf {
  std::uint32_t r = 0, v = 0;
  double off = std::numeric_limits<double>::infinity();  // squared, from the middle
};
using SiteSquare = std::array<double, 2>;  // whole numbers

std::unordered_map<SiteSquare, ViewpointOf, CellHash> nearest_to_middles(
    const std::vector<PointCloud>& viewpoints, double width) {
  std::unordered_map<SiteSquare, ViewpointOf, CellHash> nearest;
  for (std::uint32_t r = 0; r < viewpoints.size(); ++r) {
    for (std::uint32_t v = 0; v < viewpoints[r].size(); ++v) {
      const Eigen::Array2d at = viewpoints[r][v].head<2>().array() / width;
      const Eigen::Array2d square = at.floor();
      const double off = (at - square - 0.5).square().sum();
      ViewpointOf& best = nearest[{square.x(), square.y()}];
      if (off < best.off) best = {r, v, off};
    }
  }
  return nearest;
}

}  // namespace

std::vector<SitePlace> spread_sites(const std::vector<PointCloud>& viewpoints, double spacing,
                                    std::size_t most) {
  constexpr double kWider = 1.1, kWidest = 1e8;  // [m]
  if (most == 0) return {};
  auto nearest = nearest_to_middles(viewpoints, spacing);
  while (nearest.size() > most && spacing < kWidest) {
    spacing *= kWider;
    nearest = nearest_to_middles(viewpoints, spacing);
  }
  std::vector<std::vector<bool>> chosen;
  for (const PointCloud& of_region : viewpoints) chosen.emplace_back(of_region.size(), false);
  for (const auto& [square, which] : nearest) chosen[which.r][which.v] = true;
  std::vector<SitePlace> sites;
  for (std::uint32_t r = 0; r < viewpoints.size(); ++r) {
    for (std::size_t v = 0; v < viewpoints[r].size() && sites.size() < most; ++v) {
      if (chosen[r][v]) sites.push_back({RegionId{r}, viewpoints[r][v]});
    }
  }
  return sites;
}

}  // namespace vantage
