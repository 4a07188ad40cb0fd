#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

/// Regions of any shape, made of square cells in plan view. Partitioners use them for regions that
/// follow something: they say which region each cell belongs to, or what each region grows around.
namespace vantage {

/// Cell (i, j) of a raster. Sorted by rows: first j (y), then i (x).
struct PlanCell {
  std::int32_t j, i;
  friend auto operator<=>(const PlanCell&, const PlanCell&) = default;
};

/// Square cells anchored at the origin of the frame, so that cells of neighbouring maps fit
/// together: edge(i) <= x < edge(i + 1), and the same in y. Neighbouring cells share the same
/// number as their edge.
class VANTAGE_API PlanRaster {
 public:
  /// @param bounds     what the cells must cover [m]; not empty, finite
  /// @param cell_size  [m], > 0
  /// Errors: `invalid_input` if the index of a cell would reach 2^31, or if a cell is not wider
  /// than the rounding of coordinates.
  [[nodiscard]] static Result<PlanRaster> over(const Bounds3& bounds, double cell_size);

  [[nodiscard]] double cell_size() const noexcept { return cell_size_; }
  /// The coordinate where cell i begins [m].
  [[nodiscard]] double edge(std::int64_t i) const noexcept;
  /// Precondition: xy lies within the bounds.
  [[nodiscard]] PlanCell cell_of(const Eigen::Vector2d& xy) const noexcept;
  /// [m]
  [[nodiscard]] Eigen::Vector2d centre(const PlanCell& cell) const noexcept;

 private:
  explicit PlanRaster(double cell_size) noexcept : cell_size_(cell_size) {}
  double cell_size_;
};

/// The cells that hold at least one point, sorted by rows.
/// Precondition: all points lie within the raster's bounds.
[[nodiscard]] VANTAGE_API std::vector<PlanCell> occupied_cells(PointsView points,
                                                               const PlanRaster& raster);

struct OwnedCell {
  PlanCell cell;
  std::uint32_t region = 0;
};

/// Makes a partition. Region r has the label labels[r] and consists of the cells that name r. Cells
/// are joined into few boxes: runs of a row, and equal runs of successive rows. A region of one box
/// is a HalfOpenBox. The result does not depend on the order of `cells`.
/// Errors: `invalid_input` for a cell that is named twice, a region without a label or without a
/// cell, and what Partition::from refuses.
[[nodiscard]] VANTAGE_API Result<Partition> partition_of_cells(const PlanRaster& raster,
                                                               std::vector<OwnedCell> cells,
                                                               std::span<const std::string> labels);

/// A straight segment, in plan view, that a region grows around; both ends may be the same place
/// [m].
struct Seed {
  Eigen::Vector2d from, to;
  std::uint32_t region = 0;
};

/// How partition_by_nearest makes cells [m].
struct NearestParams {
  double cell_size = 1.0;    ///< > 0
  double fill_radius = 0.0;  ///< >= 0
};

/// Gives every cell to the region with the nearest seed, measured from the cell's centre; of
/// equally near regions, the one with the lower number gets it. The cells are those that hold a
/// point of the map, and those in the map's plan-view box whose centre lies within `fill_radius` of
/// a seed: a robot can be there although the map shows nothing.
/// A region that is nearest to no occupied cell is left out, and its places go to the next nearest
/// region.
/// Takes about n log n in the number of seeds, points and cells if the seeds have similar lengths;
/// a long seed among many short ones costs more time. The result is the same for any number of
/// threads and any order of the points.
/// @param map     N points [m]; borrowed
/// @param seeds   at least one; finite
/// @param labels  of the regions that the seeds name
/// Errors: `invalid_input` for what check_points and PlanRaster::over refuse; for no seed, a seed
/// that is not finite, or a seed without a label; for more than 100 million cells; for labels that
/// are not unique or not safe in a file name.
[[nodiscard]] VANTAGE_API Result<Partition> partition_by_nearest(
    PointsView map, std::span<const Seed> seeds, std::span<const std::string> labels,
    const NearestParams& params);

}  // namespace vantage
