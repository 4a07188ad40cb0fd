#include "common/minimum_raster.hpp"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

namespace vantage::terrain {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr int kMostSupport =
    (2 * MinimumRaster::kNeighbourhood + 1) * (2 * MinimumRaster::kNeighbourhood + 1);
constexpr double kMaxCells = 0x1p27;  // of one raster, with the border that windows need

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
  // Beyond the whole raster all windows see the same.
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
      lowest_(width * height, kNoPoint) {
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

Heights MinimumRaster::heights() const {
  Heights heights{width_, height_, std::vector<double>(lowest_.size())};
  for (std::size_t cell = 0; cell < lowest_.size(); ++cell) heights.z[cell] = lowest_[cell].z();
  return heights;
}

void MinimumRaster::take_if_lower(std::size_t i) noexcept {
  Point& lowest = lowest_[cell_of_member_[i]];
  const Point& p = cloud_[members_[i]];
  // A total order of places, so that the order of the points does not matter.
  if (std::tuple(p.z(), p.x(), p.y()) < std::tuple(lowest.z(), lowest.x(), lowest.y())) {
    lowest = p;
  }
}

void MinimumRaster::remove_low_outliers(const OutlierRule& rule) {
  for (int pass = 0; pass < kOutlierPasses; ++pass) {
    const std::vector<std::uint8_t> support = supports(rule.height);
    std::vector<std::pair<std::size_t, double>> outliers;  // cell, the surface above it [m]
    for (std::size_t cell = 0; cell < lowest_.size(); ++cell) {
      const double enough = rule.ratio * support[cell];
      if (support[cell] == 0 || enough >= kMostSupport) continue;
      std::uint8_t most = 0;
      double surface = 0.0;
      for_neighbours(cell, [&](std::size_t other, double distance) {
        const double least = lowest_[other].z() - rule.height - rule.slope * distance;
        if (least <= lowest_[cell].z()) return;
        if (support[other] > most || (support[other] == most && least < surface)) {
          most = support[other];
          surface = least;
        }
      });
      if (most > enough) outliers.emplace_back(cell, surface);
    }
    if (outliers.empty()) return;
    std::vector<double> floor(lowest_.size(), kNothing);
    for (const auto& [cell, surface] : outliers) {
      lowest_[cell] = kNoPoint;
      floor[cell] = surface;
    }
    for (std::size_t i = 0; i < members_.size(); ++i) {
      if (cloud_[members_[i]].z() >= floor[cell_of_member_[i]]) take_if_lower(i);
    }
  }
}

/// Cell by cell how many of the cells around it, itself included, are at its height; 0 for no
/// cell.
std::vector<std::uint8_t> MinimumRaster::supports(double height) const {
  const Heights surface = heights();
  std::vector<std::uint8_t> support(lowest_.size(), 0);
  const auto step = [](std::size_t i, int d) {
    return static_cast<std::size_t>(static_cast<std::int64_t>(i) + d);
  };
  for (std::size_t y = 0; y < height_; ++y) {
    for (int dy = -kNeighbourhood; dy <= kNeighbourhood; ++dy) {
      if (step(y, dy) >= height_) continue;
      for (int dx = -kNeighbourhood; dx <= kNeighbourhood; ++dx) {
        const std::size_t begin = dx < 0 ? static_cast<std::size_t>(-dx) : 0;
        const std::size_t beyond = dx > 0 ? static_cast<std::size_t>(dx) : 0;
        for (std::size_t x = begin; x + beyond < width_; ++x) {
          const double here = surface.z[y * width_ + x];
          const double there = surface.z[step(y, dy) * width_ + step(x, dx)];
          const bool equal = std::abs(there - here) <= height;
          support[y * width_ + x] = static_cast<std::uint8_t>(support[y * width_ + x] + equal);
        }
      }
    }
  }
  return support;
}

}  // namespace vantage::terrain
