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

/// The position of a region in its Partition: 0 .. regions - 1, without gaps.
struct RegionId {
  std::uint32_t value = 0;
  friend auto operator<=>(const RegionId&, const RegionId&) = default;
};

/// A rectangle min <= (x, y) < max [m]: the cell of Eq. 2.
struct HalfOpenBox {
  Eigen::Vector2d min, max;
  friend bool operator==(const HalfOpenBox&, const HalfOpenBox&) = default;
};

/// A convex polygon of at least three corners, counter-clockwise [m]. It owns its border; where
/// footprints touch, the region with the lower id owns the border.
struct ConvexPolygon {
  std::vector<Eigen::Vector2d> corners;
  friend bool operator==(const ConvexPolygon&, const ConvexPolygon&) = default;
};

/// Every place in at least one of the boxes. Small boxes approximate any shape.
struct BoxUnion {
  std::vector<HalfOpenBox> boxes;
  friend bool operator==(const BoxUnion&, const BoxUnion&) = default;
};

using Footprint = std::variant<HalfOpenBox, ConvexPolygon, BoxUnion>;

/// Half-open height interval [m], for storeys and overpasses; the default contains every height.
struct HeightInterval {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  [[nodiscard]] bool contains(double z) const noexcept { return min <= z && z < max; }
  friend bool operator==(const HeightInterval&, const HeightInterval&) = default;
};

/// One local region G_ij: where it is and what it is called.
struct Region {
  /// Unique and safe in a file name: at most 200 letters, digits, '_', '-', '+' and '.'; the first
  /// is not '.'.
  std::string label;
  Footprint footprint;
  HeightInterval height;
  friend bool operator==(const Region&, const Region&) = default;
};

/// A rectangle in plan view [m], both ends included. A default-constructed one is empty (min >
/// max).
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

/// The tightest rectangle around a footprint; empty if the footprint has no corners or boxes.
[[nodiscard]] VANTAGE_API Bounds2 bounds_of(const Footprint&) noexcept;
[[nodiscard]] VANTAGE_API bool contains(const Footprint&, const Eigen::Vector2d& xy) noexcept;
/// Plan-view distance to the footprint [m]; 0 inside.
[[nodiscard]] VANTAGE_API double distance(const Footprint&, const Eigen::Vector2d& xy) noexcept;

/// Why no partition can have this region, whatever the others are: a label that is not safe in a
/// file name, a footprint or a height interval that is none. Empty for a sound region. Whoever
/// reads a region from outside asks this.
[[nodiscard]] VANTAGE_API std::string defect_of(const Region& region);

/// How a map is cut into regions. A Partition is plain, validated data: a bundle opens without the
/// partitioner that made it. Building (Eq. 3) and running (Eq. 11) use the same `locate`, so that
/// they never disagree about a point on an edge.
class VANTAGE_API Partition {
 public:
  /// An empty partition has no regions and locates nothing.
  Partition() = default;

  /// Errors: `invalid_input` if there is no region; for an empty or non-finite footprint, a polygon
  /// that is not convex and counter-clockwise, or a union without boxes; for an empty height
  /// interval; for a label that is not safe in a file name or that two regions share.
  [[nodiscard]] static Result<Partition> from(std::vector<Region> regions);

  [[nodiscard]] const std::vector<Region>& regions() const noexcept { return regions_; }
  [[nodiscard]] std::size_t size() const noexcept { return regions_.size(); }
  [[nodiscard]] const Region& operator[](RegionId id) const { return regions_.at(id.value); }

  /// The region that owns a place: of the regions that contain it, the one with the lowest id; none
  /// if the place is outside all regions. Takes constant time on average if regions have similar
  /// sizes.
  [[nodiscard]] std::optional<RegionId> locate(const Point& p) const noexcept;
  /// The same in plan view, without regard to height intervals.
  [[nodiscard]] std::optional<RegionId> locate(const Eigen::Vector2d& xy) const noexcept;

 private:
  struct Grid;
  std::vector<Region> regions_;
  std::shared_ptr<const Grid> grid_;  // immutable search structure, shared by copies

  template <class Accept>
  std::optional<RegionId> locate_if(const Eigen::Vector2d& xy, const Accept& accept) const noexcept;
};

}  // namespace vantage
