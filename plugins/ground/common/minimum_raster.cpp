#include "common/minimum_raster.hpp"

#include <algorithm>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

namespace vantage::terrain {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr int kMostSupport =
    (2 * MinimumRaster::kNeighbourhood + 1) * (2 * MinimumRaster::kNeighbourhood + 1);
constexpr double kMaxCells = 0x1p27;  // of one raster, including the border that windows need

}  // namespace

Result<MinimumRaster> MinimumRaster::over(PointsView cloud, IndexList members, double cell_size,
                                          const LargestWindow& window) {
  Cell min = cell_of(cloud[members.front()], cell_size), max = min;
  for (const std::uint32_t k : members) {
    const Cell cell = cell_of(cloud[k], cell_size);
    min = {std::min(min.x, cell.x), std::min(min.y, cell.y)};
    max = {std::max(max.x, cell.x), std::max(max.y, cell.y)};
  }
  const auto width = static_cast<std::size_t>(max.x - min.x + 1);
  const auto height = static_cast<std::size_t>(max.y - min.y + 1);
  // Outside the whole raster, all windows see the same.
  const auto border = 2.0 * static_cast<double>(std::min(window.radius, std::max(width, height)));
  if ((static_cast<double>(width) + border) * (static_cast<double>(height) + border) > kMaxCells) {
    return fail(ErrorCode::invalid_input,
                "windows of " + std::to_string(2 * window.radius + 1) +
                    " cells need too large a raster with cells of " + std::to_string(cell_size) +
                    " m; choose a larger cell_size or a smaller " + window.key);
  }
  return MinimumRaster(cloud, std::move(members), cell_size, min, width, height);
}

MinimumRaster::MinimumRaster(PointsView cloud, IndexList members, double cell_size, const Cell& min,
                             std::size_t width, std::size_t height)
    : cloud_(cloud),
      members_(std::move(members)),
      cell_size_(cell_size),
      min_(min),
      width_(width),
      height_(height),
      cell_of_member_(members_.size()),
      lowest_(width * height, kNoPoint),
      z_(width * height, kNothing) {
  for (int dy = -kNeighbourhood; dy <= kNeighbourhood; ++dy) {
    for (int dx = -kNeighbourhood; dx <= kNeighbourhood; ++dx) {
      distances_[offset(dx, dy)] = cell_size_ * std::hypot(dx, dy);
    }
  }
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Cell cell = cell_of(cloud_[members_[i]], cell_size_);
    cell_of_member_[i] =
        static_cast<std::uint32_t>(static_cast<std::size_t>(cell.y - min.y) * width_ +
                                   static_cast<std::size_t>(cell.x - min.x));
    take_if_lower(i);
  }
}

Eigen::Vector2d MinimumRaster::centre(std::size_t cell) const noexcept {
  const auto x = min_.x + static_cast<std::int64_t>(cell % width_);
  const auto y = min_.y + static_cast<std::int64_t>(cell / width_);
  return {cell_size_ * (static_cast<double>(x) + 0.5), cell_size_ * (static_cast<double>(y) + 0.5)};
}

Heights MinimumRaster::heights() const { return {width_, height_, z_}; }

void MinimumRaster::take_if_lower(std::size_t i) noexcept {
  const Point& p = cloud_[members_[i]];
  if (p.z() > z_[cell_of_member_[i]]) return;
  Point& lowest = lowest_[cell_of_member_[i]];
  // A total order of places, so that the order of the points does not matter.
  if (std::tuple(p.z(), p.x(), p.y()) < std::tuple(lowest.z(), lowest.x(), lowest.y())) {
    lowest = p;
    z_[cell_of_member_[i]] = p.z();
  }
}

void MinimumRaster::remove_low_outliers(const OutlierRule& rule) {
  std::vector<std::uint8_t> support = supports(rule.height);
  std::vector<std::size_t> candidates(lowest_.size());
  std::iota(candidates.begin(), candidates.end(), std::size_t{0});
  for (int pass = 0; pass < kOutlierPasses; ++pass) {
    std::vector<std::size_t> outliers;
    std::vector<double> surfaces;  // points below their surface are outliers [m]
    for (const std::size_t cell : candidates) {
      const double enough = rule.ratio * support[cell];
      if (support[cell] == 0 || enough >= kMostSupport) continue;
      std::uint8_t most = 0;
      double surface = 0.0;
      for_neighbours(cell, [&](std::size_t other, double distance) {
        const double least = z_[other] - rule.height - rule.slope * distance;
        if (least <= z_[cell]) return;
        if (support[other] > most || (support[other] == most && least < surface)) {
          most = support[other];
          surface = least;
        }
      });
      if (most <= enough) continue;
      outliers.push_back(cell);
      surfaces.push_back(surface);
    }
    if (outliers.empty()) return;
    raise(outliers, surfaces);
    // No other support has changed, and no decision farther away.
    for (const std::size_t cell : around(outliers, kNeighbourhood)) {
      support[cell] = support_of(cell, rule.height);
    }
    candidates = around(outliers, 2 * kNeighbourhood);
  }
}

/// Gives each of the cells its lowest point that is not below a surface.
void MinimumRaster::raise(const std::vector<std::size_t>& cells,
                          const std::vector<double>& surfaces) {
  std::vector<double> floor(lowest_.size(), kNothing);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    lowest_[cells[k]] = kNoPoint;
    z_[cells[k]] = kNothing;
    floor[cells[k]] = surfaces[k];
  }
  for (std::size_t i = 0; i < members_.size(); ++i) {
    if (cloud_[members_[i]].z() >= floor[cell_of_member_[i]]) take_if_lower(i);
  }
}

/// The cells within `reach` of at least one of the given cells, ascending.
std::vector<std::size_t> MinimumRaster::around(const std::vector<std::size_t>& cells,
                                               std::size_t reach) const {
  std::vector<bool> is_near(lowest_.size(), false);
  for (const std::size_t cell : cells) {
    const std::size_t x0 = cell % width_, y0 = cell / width_;
    for (std::size_t y = y0 - std::min(y0, reach); y <= std::min(y0 + reach, height_ - 1); ++y) {
      for (std::size_t x = x0 - std::min(x0, reach); x <= std::min(x0 + reach, width_ - 1); ++x) {
        is_near[y * width_ + x] = true;
      }
    }
  }
  std::vector<std::size_t> near;
  for (std::size_t cell = 0; cell < is_near.size(); ++cell) {
    if (is_near[cell]) near.push_back(cell);
  }
  return near;
}

/// How many of the cells around a cell, itself included, have its height; 0 if the cell has no
/// point.
std::uint8_t MinimumRaster::support_of(std::size_t cell, double height) const {
  int support = 0;
  for_neighbours(cell, [&](std::size_t other, double) {
    support += std::abs(z_[other] - z_[cell]) <= height ? 1 : 0;
  });
  return static_cast<std::uint8_t>(support);
}

/// The support of every cell.
std::vector<std::uint8_t> MinimumRaster::supports(double height) const {
  std::vector<std::uint8_t> support(z_.size());
  std::vector<std::int64_t> row(width_);  // as wide as the heights, so that the loop is vectorized
  const auto step = [](std::size_t i, int d) {
    return static_cast<std::size_t>(static_cast<std::int64_t>(i) + d);
  };
  for (std::size_t y = 0; y < height_; ++y) {
    std::ranges::fill(row, 0);
    for (int dy = -kNeighbourhood; dy <= kNeighbourhood; ++dy) {
      if (step(y, dy) >= height_) continue;
      for (int dx = -kNeighbourhood; dx <= kNeighbourhood; ++dx) {
        const std::size_t begin = dx < 0 ? static_cast<std::size_t>(-dx) : 0;
        const std::size_t beyond = dx > 0 ? static_cast<std::size_t>(dx) : 0;
        const double* here = z_.data() + y * width_;
        const double* there = z_.data() + step(step(y, dy) * width_, dx);
        for (std::size_t x = begin; x + beyond < width_; ++x) {
          row[x] += std::abs(there[x] - here[x]) <= height ? 1 : 0;
        }
      }
    }
    for (std::size_t x = 0; x < width_; ++x) {
      support[y * width_ + x] = static_cast<std::uint8_t>(row[x]);
    }
  }
  return support;
}

}  // namespace vantage::terrain
