#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/map_passes.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

/// Regions of any shape, made of square cells in plan view. A partitioner assigns each cell to a
/// region, or says what each region grows around.
namespace vantage {

/// Cell (i, j) of a raster. Sorted by rows: first j (y), then i (x).
struct PlanCell {
  std::int32_t j, i;
  friend auto operator<=>(const PlanCell&, const PlanCell&) = default;
};

/// The width of cells, and the name of its parameter for errors.
struct CellWidth {
  double value;          ///< [m], > 0
  std::string_view key;  ///< of the parameter, for example "cell_size"
};

/// Square cells of one width. A cell owns the places from its lower left corner (included) to its
/// upper right corner (not included). The four cells that meet at a corner use the same coordinates
/// for it: each is rounded once, so no compiler flag changes it.
class PlanRaster {
 public:
  /// Cells anchored at the origin of the frame, so that the cells of neighbouring maps coincide.
  /// @param bounds     what the cells must cover [m]; not empty, finite
  /// @param cell_size  [m], > 0
  /// Errors: `invalid_input` if the index of a cell would reach 2^31, or if a cell is not wider
  /// than the rounding of coordinates.
  [[nodiscard]] static Result<PlanRaster> over(const Bounds3& bounds, double cell_size);
  /// The same with the corner of cell (0, 0) at `origin` [m].
  [[nodiscard]] static Result<PlanRaster> over(const Bounds3& bounds, const CellWidth& width,
                                               const Eigen::Vector2d& origin);

  [[nodiscard]] double cell_size() const noexcept { return cell_size_; }
  /// The lower left corner of cell (i, j) [m].
  [[nodiscard]] Eigen::Vector2d corner(std::int64_t i, std::int64_t j) const noexcept {
    return {edge(0, i), edge(1, j)};
  }
  /// The cell that owns a place. Precondition: xy lies within the bounds.
  [[nodiscard]] PlanCell cell_of(const Eigen::Vector2d& xy) const noexcept;
  /// The centre of a cell [m].
  [[nodiscard]] Eigen::Vector2d centre(const PlanCell& cell) const noexcept;

 private:
  PlanRaster(double cell_size, const Eigen::Vector2d& origin) noexcept
      : cell_size_(cell_size), origin_(origin) {}
  [[nodiscard]] double edge(Eigen::Index axis, std::int64_t i) const noexcept;

  double cell_size_;
  Eigen::Vector2d origin_;
};

/// The cells that hold at least one point, sorted by rows. Precondition: all points lie within the
/// raster's bounds. Errors: those of the pass.
[[nodiscard]] Result<std::vector<PlanCell>> occupied_cells(const MapPasses& map,
                                                           const PlanRaster& raster);

struct OwnedCell {
  PlanCell cell;
  std::uint32_t region = 0;
};

/// The partition in which region r has the label labels[r] and consists of the cells that name it.
/// Cells are joined into few boxes: runs within a row, and equal runs of successive rows. A region
/// of one box is a HalfOpenBox. The order of `cells` does not matter.
/// Errors: `invalid_input` for a cell that is listed twice, a region without a label or a cell, and
/// for what Partition::from refuses.
[[nodiscard]] Result<Partition> partition_of_cells(const PlanRaster& raster,
                                                   std::vector<OwnedCell> cells,
                                                   std::span<const std::string> labels);

/// A straight segment in plan view [m] around which a region grows. Its ends may coincide.
struct Seed {
  Eigen::Vector2d from, to;
  std::uint32_t region = 0;
};

/// Parameters of partition_by_nearest [m].
struct NearestParams {
  double cell_size = 1.0;    ///< > 0
  double fill_radius = 0.0;  ///< >= 0
};

/// Gives every cell to the region with the nearest seed, measured from the cell's centre; of
/// equally near regions, to the one with the lower number. The cells are those that hold a point of
/// the map, and those in the map's plan-view box whose centre lies within `fill_radius` of a seed:
/// a robot can be there although the map has no point there.
/// A region that is nearest to no occupied cell is left out; its cells go to the next nearest
/// region.
/// Takes about n log n in the number of seeds, points and cells if the seeds have similar lengths;
/// a long seed among many short ones costs more time. The result is the same for any number of
/// threads and any order of the points.
/// @param seeds   at least one; finite
/// @param labels  of the regions that the seeds name
/// Errors: those of the pass; `invalid_input` for a map without points, for what PlanRaster::over
/// refuses, for no seed, for a seed that is not finite or names no label, for more than 100 million
/// cells, and for labels that are not file-safe or not unique.
[[nodiscard]] Result<Partition> partition_by_nearest(const MapPasses& map,
                                                     std::span<const Seed> seeds,
                                                     std::span<const std::string> labels,
                                                     const NearestParams& params);

}  // namespace vantage
