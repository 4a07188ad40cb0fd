#include "common/tiles.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include <tbb/parallel_for.h>

#include "vantage/kit/hash.hpp"

namespace vantage::terrain {
namespace {

constexpr double kMaxIndex = 0x1p52;
constexpr std::int64_t kTileWidth = 1024;  // [cells]

/// The points, sorted into square tiles.
class Tiles {
 public:
  Tiles(PointsView cloud, const Bounds3& bounds, const Tiling& tiling)
      : cloud_(cloud), cell_size_(tiling.cell_size), reach_(tiling.reach) {
    width_ = std::max(kTileWidth, 4 * reach_);
    origin_ = cell_of(bounds.min, cell_size_);
    tile_of_point_.reserve(cloud_.size());
    for (const Point& p : cloud_) tile_of_point_.push_back(number_of(tile_of(p)));
    points_.resize(tiles_.size());
    for (std::uint32_t k = 0; k < cloud_.size(); ++k) points_[tile_of_point_[k]].push_back(k);
  }

  [[nodiscard]] std::size_t size() const noexcept { return tiles_.size(); }
  [[nodiscard]] bool holds(std::size_t tile, std::uint32_t point) const noexcept {
    return tile_of_point_[point] == tile;
  }
  /// The points of a tile, and those within reach of it.
  [[nodiscard]] IndexList with_surroundings(std::size_t tile) const {
    const Cell& t = tiles_[tile];
    const Cell min{origin_.x + t.x * width_ - reach_, origin_.y + t.y * width_ - reach_};
    const std::int64_t extent = width_ + 2 * reach_;
    IndexList members;
    members.reserve(points_[tile].size());
    for (std::int64_t y = t.y - 1; y <= t.y + 1; ++y) {
      for (std::int64_t x = t.x - 1; x <= t.x + 1; ++x) {
        const auto found = number_.find({x, y});
        if (found == number_.end()) continue;
        const IndexList& points = points_[found->second];
        if (found->second == tile) {
          members.insert(members.end(), points.begin(), points.end());
          continue;
        }
        for (const std::uint32_t k : points) {
          const Cell cell = cell_of(cloud_[k], cell_size_);
          if (cell.x >= min.x && cell.x < min.x + extent && cell.y >= min.y &&
              cell.y < min.y + extent) {
            members.push_back(k);
          }
        }
      }
    }
    return members;
  }

 private:
  struct Hash {
    std::size_t operator()(const Cell& cell) const noexcept {
      return CellHash{}(std::array{cell.x, cell.y});
    }
  };
  [[nodiscard]] Cell tile_of(const Point& p) const noexcept {
    const Cell cell = cell_of(p, cell_size_);
    return {(cell.x - origin_.x) / width_, (cell.y - origin_.y) / width_};
  }
  /// The number of a tile; a new tile gets the next number.
  std::uint32_t number_of(const Cell& tile) {
    if (!tiles_.empty() && tiles_[last_] == tile) return last_;  // as for most consecutive points
    const auto [at, is_new] = number_.try_emplace(tile, static_cast<std::uint32_t>(tiles_.size()));
    if (is_new) tiles_.push_back(tile);
    return last_ = at->second;
  }

  PointsView cloud_;
  double cell_size_;
  std::int64_t reach_, width_;  // [cells]
  Cell origin_;                 // no point lies in a lower cell
  std::vector<Cell> tiles_;
  std::vector<IndexList> points_;  // by tile
  std::vector<std::uint32_t> tile_of_point_;
  std::unordered_map<Cell, std::uint32_t, Hash> number_;
  std::uint32_t last_ = 0;  // the number returned last
};

}  // namespace

Result<IndexList> ground_by_tiles(
    PointsView cloud, const Tiling& tiling,
    const std::function<void(MinimumRaster&, const Found&)>& find_ground) {
  VANTAGE_CHECK(check_points(cloud, "the cloud"));
  const Bounds3 bounds = bounds_of(cloud);
  const double farthest = std::max(bounds.min.head<2>().cwiseAbs().maxCoeff(),
                                   bounds.max.head<2>().cwiseAbs().maxCoeff());
  if (!(farthest / tiling.cell_size < kMaxIndex)) {
    return fail(ErrorCode::invalid_input, "a coordinate of " + std::to_string(farthest) +
                                              " m is too far from the origin for cells of " +
                                              std::to_string(tiling.cell_size) + " m");
  }
  const Tiles tiles(cloud, bounds, tiling);
  std::vector<std::uint8_t> is_ground(cloud.size(), 0);
  std::vector<std::optional<Error>> errors(tiles.size());
  tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t tile) {
    auto raster =
        MinimumRaster::over(cloud, tiles.with_surroundings(tile), tiling.cell_size, tiling.window);
    if (!raster) {
      errors[tile] = std::move(raster).error();
      return;
    }
    find_ground(*raster, [&](std::uint32_t k) {
      if (tiles.holds(tile, k)) is_ground[k] = 1;
    });
  });
  for (std::optional<Error>& error : errors) {
    if (error) return fail(*std::move(error));
  }
  IndexList indices;
  indices.reserve(static_cast<std::size_t>(std::count(is_ground.begin(), is_ground.end(), 1)));
  for (std::uint32_t k = 0; k < cloud.size(); ++k) {
    if (is_ground[k] != 0) indices.push_back(k);
  }
  return indices;
}

}  // namespace vantage::terrain
