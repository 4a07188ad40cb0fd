#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::surface {

/// How points of one cell lie: as a piece of a surface, or as clutter.
struct Shape {
  Point centre = Point::Zero();  ///< mean of the points [m]
  /// Principal axes, the normal of the plane first, and how far the covered area extends along them
  /// [m].
  Eigen::Matrix3f axes = Eigen::Matrix3f::Identity();
  Eigen::Vector3f extents = Eigen::Vector3f::Zero();
  float thickness = 0.0F;    ///< standard deviation along the normal [m]
  float fill = 0.0F;         ///< occupied blocks, divided by those that a surface across the cell
                             ///< would occupy
  float density = 0.0F;      ///< the same, divided by those that a surface of these extents would
                             ///< occupy
  bool is_isolated = false;  ///< too few points to say how they lie
  bool is_flat = false;      ///< enough points for a normal
};

/// What an element belongs to, judged by its surroundings.
enum class Part : std::uint8_t {
  structure,  ///< or unknown
  ground,     ///< level, with no other ground beneath it
  /// Stands on the ground and is not higher than a vehicle, or the ground continues beneath it. It
  /// may be the trail of something that moved, or something that can move away.
  low,
};

/// The points of one cell of a cubic grid.
struct Element {
  Shape shape;
  std::uint32_t begin = 0, end = 0;  ///< of `Elements::points`
  Part part = Part::structure;
};

/// A map, cut into elements. Neither the elements nor their order depend on the order of the
/// points.
class Elements {
 public:
  /// Errors: `invalid_input` for a map of more than 2^20 cells along an axis.
  /// @param origin         corner of the grid; no coordinate of a point is below it [m]
  /// @param point_spacing  of the map's surfaces; a cell is 2.5 times as wide [m]
  [[nodiscard]] static Result<Elements> of(PointsView map, const Point& origin,
                                           double point_spacing);

  /// In ascending order of their cells' x, then y, then z.
  [[nodiscard]] std::span<const Element> all() const noexcept { return elements_; }
  [[nodiscard]] double width() const noexcept { return width_; }  ///< of a cell [m]
  /// The largest possible `fill` of an element.
  [[nodiscard]] static double fullest() noexcept;
  /// The largest distance from an element of points that decide which part it belongs to [m].
  [[nodiscard]] double reach_of_part() const noexcept;
  /// How far, in plan view, the points lie at most that decide about an element [m].
  [[nodiscard]] static double reach_around(double point_spacing) noexcept;
  /// Indices into the map.
  [[nodiscard]] std::span<const std::uint32_t> points(const Element& element) const noexcept {
    return std::span(indices_).subspan(element.begin, element.end - element.begin);
  }
  /// Where the cell of an element lies among the cells of the grid.
  struct Cell {
    std::int32_t x, y, z;
  };
  [[nodiscard]] Cell cell(std::uint32_t number) const noexcept;
  [[nodiscard]] const Point& origin() const noexcept { return origin_; }  ///< of the grid [m]

  /// The shape of the given points of one element. Precondition: at least one point.
  [[nodiscard]] Shape measure(PointsView map, std::span<const std::uint32_t> points) const;

 private:
  Elements(const Point& origin, double point_spacing)
      : origin_(origin), point_spacing_(point_spacing), width_(kSpacings * point_spacing) {}
  void find_parts();

  static constexpr double kSpacings = 2.5;  // width of a cell in point spacings

  Point origin_;
  double point_spacing_, width_;
  std::vector<std::uint32_t> indices_;  // by element, then by place
  std::vector<Element> elements_;       // by cell
  std::vector<std::uint64_t> cells_;    // of each element, ascending: x, y and z from high to low
};

}  // namespace vantage::surface
