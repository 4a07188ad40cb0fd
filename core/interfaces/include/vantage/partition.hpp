#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Dense: 0 .. regions - 1, the position of the region in its Partition.
struct RegionId {
  std::uint32_t value = 0;
  friend auto operator<=>(const RegionId&, const RegionId&) = default;
};

/// min <= (x, y) < max, the cell of Eq. 2 [m].
struct HalfOpenBox {
  Eigen::Vector2d min, max;
  friend bool operator==(const HalfOpenBox&, const HalfOpenBox&) = default;
};

/// Convex, counter-clockwise, at least three corners [m]. A point on the border belongs to it;
/// where footprints touch, the region with the lower id owns the border.
struct ConvexPolygon {
  std::vector<Eigen::Vector2d> corners;
  friend bool operator==(const ConvexPolygon&, const ConvexPolygon&) = default;
};

/// Every place in at least one of the boxes; any shape, as fine as the boxes are.
struct BoxUnion {
  std::vector<HalfOpenBox> boxes;
  friend bool operator==(const BoxUnion&, const BoxUnion&) = default;
};

using Footprint = std::variant<HalfOpenBox, ConvexPolygon, BoxUnion>;

/// Half-open height interval [m] for storeys and overpasses; by default everything.
struct HeightInterval {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  [[nodiscard]] bool contains(double z) const noexcept { return min <= z && z < max; }
  friend bool operator==(const HeightInterval&, const HeightInterval&) = default;
};

/// One local region G_ij: where it is and what it is called.
struct Region {
  /// Unique and file-safe: at most 200 letters, digits, '_', '-', '+', '.', the first not '.'.
  std::string label;
  Footprint footprint;
  HeightInterval height;
  friend bool operator==(const Region&, const Region&) = default;
};

/// A rectangle in plan [m], both ends included. Default constructed it is empty (min > max).
struct Bounds2 {
  Eigen::Vector2d min = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d max = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());

  [[nodiscard]] bool contains(const Eigen::Vector2d& xy) const noexcept {
    return min.x() <= xy.x() && xy.x() <= max.x() && min.y() <= xy.y() && xy.y() <= max.y();
  }
  void extend(const Eigen::Vector2d& xy) noexcept {
    min = min.cwiseMin(xy);
    max = max.cwiseMax(xy);
  }
};

/// The tightest rectangle around a footprint; empty for one without corners or boxes.
[[nodiscard]] VANTAGE_API Bounds2 bounds_of(const Footprint&) noexcept;
[[nodiscard]] VANTAGE_API bool contains(const Footprint&, const Eigen::Vector2d& xy) noexcept;
/// Plan-view distance to the footprint [m]; 0 inside.
[[nodiscard]] VANTAGE_API double distance(const Footprint&, const Eigen::Vector2d& xy) noexcept;

/// How a map is cut into regions. Plain, validated data: a bundle opens without the partitioner
/// that made it, and one `locate` serves building (Eq. 3) and running (Eq. 11), so the two can
/// never disagree about a point on an edge.
class VANTAGE_API Partition {
 public:
  /// An empty partition has no regions and locates nothing.
  Partition() = default;

  /// Errors: `invalid_input` for no region, an empty or non-finite footprint, a polygon that is not
  /// convex and counter-clockwise, a union of no boxes, a label that is not file-safe or that two
  /// regions share.
  [[nodiscard]] static Result<Partition> from(std::vector<Region> regions);

  [[nodiscard]] const std::vector<Region>& regions() const noexcept { return regions_; }
  [[nodiscard]] std::size_t size() const noexcept { return regions_.size(); }
  [[nodiscard]] const Region& operator[](RegionId id) const { return regions_.at(id.value); }

  /// The region that owns a place: the one with the lowest id that contains it, none outside all.
  /// Takes constant time on average for regions of similar size.
  [[nodiscard]] std::optional<RegionId> locate(const Point& p) const noexcept;
  /// The same in plan view: height intervals are ignored.
  [[nodiscard]] std::optional<RegionId> locate(const Eigen::Vector2d& xy) const noexcept;
  /// The region whose footprint is nearest to a place (ties: lowest id), none without regions.
  [[nodiscard]] std::optional<RegionId> nearest(const Eigen::Vector2d& xy) const noexcept;

 private:
  struct Grid;
  std::vector<Region> regions_;
  std::shared_ptr<const Grid> grid_;  // immutable search structure, shared by copies

  template <class Accept>
  std::optional<RegionId> locate_if(const Eigen::Vector2d& xy, const Accept& accept) const noexcept;
};

}  // namespace vantage
