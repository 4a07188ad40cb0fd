#include "build/atlas/sites.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <utility>

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
  std::vector<std::pair<std::uint32_t, std::uint32_t>> chosen;
  for (const auto& [square, which] : nearest) chosen.emplace_back(which.r, which.v);
  std::ranges::sort(chosen);
  chosen.resize(std::min(most, chosen.size()));
  std::vector<SitePlace> sites;
  for (const auto& [r, v] : chosen) sites.push_back({RegionId{r}, viewpoints[r][v]});
  return sites;
}

}  // namespace vantage
