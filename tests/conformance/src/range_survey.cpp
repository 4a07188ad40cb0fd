#include "vantage/conformance/range_survey.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "vantage/plugin.hpp"

namespace vantage::conformance {
namespace {

constexpr double kCell = 2.0;    // [m]
constexpr double kHeight = 1.0;  // [m]

bool owns(const Region& region, const Point& p) {
  return region.height.contains(p.z()) && contains(region.footprint, p.head<2>());
}

std::pair<double, double> cell_of(const Point& p) {
  return {std::floor(p.x() / kCell), std::floor(p.y() / kCell)};
}

}  // namespace

std::map<std::pair<double, double>, double> RangeSurvey::lowest_in(const Region* region) const {
  std::map<std::pair<double, double>, double> lowest;
  for (const Point& p : map_) {
    if (region != nullptr && !owns(*region, p)) continue;
    const auto [it, is_new] = lowest.try_emplace(cell_of(p), p.z());
    if (!is_new) it->second = std::min(it->second, p.z());
  }
  return lowest;
}

PointCloud RangeSurvey::viewpoints_in(const Region* region) const {
  PointCloud viewpoints;
  for (const auto& [cell, z] : lowest_in(region)) {
    viewpoints.push_back({kCell * (cell.first + 0.5), kCell * (cell.second + 0.5), z + kHeight});
  }
  return viewpoints;
}

Result<PointCloud> RangeSurvey::viewpoints() const noexcept {
  return guarded([&]() -> Result<PointCloud> { return viewpoints_in(nullptr); });
}

Result<Bounds3> RangeSurvey::ground_bounds() const noexcept {
  return guarded([&]() -> Result<Bounds3> {
    const auto lowest = lowest_in(nullptr);
    Bounds3 bounds;
    for (const Point& p : map_) {
      if (p.z() == lowest.at(cell_of(p))) bounds.extend(p);
    }
    return bounds;
  });
}

Result<IndexList> RangeSurvey::visible(const Point& viewpoint) const noexcept {
  return guarded([&]() -> Result<IndexList> {
    if (!viewpoint.allFinite()) {
      return fail(ErrorCode::invalid_input, "the viewpoint is not finite");
    }
    IndexList seen;
    for (std::uint32_t k = 0; k < map_.size(); ++k) {
      if ((map_[k] - viewpoint).norm() <= range_) seen.push_back(k);
    }
    return seen;
  });
}

Result<std::uint64_t> RangeSurvey::observable_points(const Region& region,
                                                     std::uint64_t enough) const noexcept {
  return guarded([&]() -> Result<std::uint64_t> {
    const PointCloud viewpoints = viewpoints_in(&region);
    std::uint64_t seen = 0;
    for (const Point& p : map_) {
      const auto sees = [&](const Point& q) { return (p - q).norm() <= range_; };
      if (std::any_of(viewpoints.begin(), viewpoints.end(), sees)) ++seen;
    }
    if (seen <= enough || above_ == AboveEnough::exact) return seen;
    return above_ == AboveEnough::one_more ? enough + 1 : std::numeric_limits<std::uint64_t>::max();
  });
}

}  // namespace vantage::conformance
