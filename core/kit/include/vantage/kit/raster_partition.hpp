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

/// Regions of any shape, made of square cells in plan view. For partitioners whose regions follow
/// something: they say which region a cell belongs to, or what each region grows around.
namespace vantage {

/// Cell (i, j) of a raster. Sorted by rows: first j (y), then i (x).
struct PlanCell {
  std::int32_t j, i;
  friend auto operator<=>(const PlanCell&, const PlanCell&) = default;
};

/// Square cells anchored at the origin of the frame, so that cells of neighbouring maps fit:
/// edge(i) <= x < edge(i + 1), and the same in y. An edge is one number for both its neighbours.
class VANTAGE_API PlanRaster {
 public:
  /// @param bounds     what the cells must cover [m]; not empty, finite
  /// @param cell_size  [m], > 0
  /// Errors: `invalid_input` if the index of a cell would not stay below 2^31, or a cell is not
  /// wider than the rounding of coordinates.
  [[nodiscard]] static Result<PlanRaster> over(const Bounds3& bounds, double cell_size);

  [[nodiscard]] double cell_size() const noexcept { return cell_size_; }
  /// Where cell i begins [m].
  [[nodiscard]] double edge(std::int64_t i) const noexcept;
  /// Precondition: xy lies within the bounds.
  [[nodiscard]] PlanCell cell_of(const Eigen::Vector2d& xy) const noexcept;
  /// [m]
  [[nodiscard]] Eigen::Vector2d centre(const PlanCell& cell) const noexcept;

 private:
  explicit PlanRaster(double cell_size) noexcept : cell_size_(cell_size) {}
  double cell_size_;
};

/// The cells that hold at least one point, by rows. Precondition: all points lie within the
/// raster's bounds.
[[nodiscard]] VANTAGE_API std::vector<PlanCell> occupied_cells(PointsView points,
                                                               const PlanRaster& raster);

struct OwnedCell {
  PlanCell cell;
  std::uint32_t region = 0;
};

/// The partition whose region r is called labels[r] and consists of the cells that name it. Cells
/// are joined into few boxes: runs of a row, and equal runs of successive rows; a region of one box
/// is a HalfOpenBox. Does not depend on the order of `cells`.
/// Errors: `invalid_input` for a cell that is named twice, a region without a label or a cell, and
/// what Partition::from refuses.
[[nodiscard]] VANTAGE_API Result<Partition> partition_of_cells(const PlanRaster& raster,
                                                               std::vector<OwnedCell> cells,
                                                               std::span<const std::string> labels);

/// A straight piece of what a region grows around, in plan view; both ends may be one place [m].
struct Seed {
  Eigen::Vector2d from, to;
  std::uint32_t region = 0;
};

/// How partition_by_nearest makes cells [m].
struct NearestParams {
  double cell_size = 1.0;    ///< > 0
  double fill_radius = 0.0;  ///< >= 0
};

/// Every cell belongs to the region with the nearest seed, measured from the cell's centre; if two
/// are as near, to the one with the lower number. Cells are those that hold a point of the map, and
/// those in the map's box in plan view whose centre lies within `fill_radius` of a seed: where a
/// robot can be though the map shows nothing.
/// A region that is nearest to no occupied cell is left out, and its places go to the next nearest.
/// Takes about n log n in the number of seeds, points and cells if the seeds are of similar length;
/// a long one among many short ones costs time. The same for any number of threads and any order of
/// the points.
/// @param map     N points [m]; borrowed
/// @param seeds   at least one; finite
/// @param labels  of the regions that the seeds name
/// Errors: `invalid_input` for what check_points and PlanRaster::over refuse, no seed or one that
/// is not finite or names no label, more than 100 million cells, and labels that are not file-safe
/// or not unique.
[[nodiscard]] VANTAGE_API Result<Partition> partition_by_nearest(
    PointsView map, std::span<const Seed> seeds, std::span<const std::string> labels,
    const NearestParams& params);

}  // namespace vantage
