#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulate/random.hpp"
#include "simulate/solid.hpp"
#include "simulate/terrain.hpp"

/// The objects of a campus. Each takes its proportions from `random` and stands on the terrain.
/// Campus frame [m].
namespace vantage::simulation {

/// A rectangle in plan view.
struct Plot {
  Eigen::Vector2d centre;
  Eigen::Vector2d along;  ///< unit, direction of `half.x()`
  Eigen::Vector2d half;   ///< half extents along and across

  [[nodiscard]] Eigen::Vector2d across() const noexcept { return {-along.y(), along.x()}; }
  /// u along, v across, from the centre.
  [[nodiscard]] Eigen::Vector2d at(double u, double v) const noexcept {
    return centre + u * along + v * across();
  }
  [[nodiscard]] Plot grown(double margin) const noexcept {
    return {centre, along, half + Eigen::Vector2d::Constant(margin)};
  }
};

/// Whether two rectangles share a point (separating axes).
[[nodiscard]] bool overlap(const Plot& a, const Plot& b) noexcept;

enum class BuildingShape : std::uint8_t { box, l_shape, round_tower, gabled };

/// Fills the plot; pilasters and canopies reach up to 2 m beyond it.
[[nodiscard]] std::vector<Solid> make_building(BuildingShape shape, const Plot& plot,
                                               const Terrain& terrain, Random& random);

/// A parked car on the slope of the ground, 1.9 m wide and up to 4.8 m long, along `along`.
[[nodiscard]] std::vector<Solid> make_car(const Eigen::Vector2d& centre,
                                          const Eigen::Vector2d& along, const Terrain& terrain,
                                          Random& random);

/// A street lamp whose arm points to `towards` (unit).
[[nodiscard]] std::vector<Solid> make_lamp(const Eigen::Vector2d& foot,
                                           const Eigen::Vector2d& towards, const Terrain& terrain,
                                           Random& random);

/// A sign plate on a post, plate across `along`.
[[nodiscard]] std::vector<Solid> make_sign(const Eigen::Vector2d& foot,
                                           const Eigen::Vector2d& along, const Terrain& terrain,
                                           Random& random);

/// Panels that follow the ground in steps; `plot.along` is the wall's direction.
[[nodiscard]] std::vector<Solid> make_wall(const Plot& plot, const Terrain& terrain,
                                           Random& random);

struct Tree {
  std::vector<Solid> wood;
  std::vector<Leaf> leaves;
};

/// A trunk and a crown of loose leaves that lets rays through; the crown starts at least 2 m above
/// the ground.
/// @param leaf_area_density  one-sided leaf area divided by crown volume [m2/m3]
[[nodiscard]] Tree make_tree(const Eigen::Vector2d& foot, double leaf_area_density,
                             const Terrain& terrain, Random& random);

/// A crown on the ground, up to 0.9 m in radius.
[[nodiscard]] Tree make_bush(const Eigen::Vector2d& foot, double leaf_area_density,
                             const Terrain& terrain, Random& random);

/// A deck on four pillars with parapets, and ramps of given lengths down to the ground. The first
/// ramp points against `direction`.
struct OverpassShape {
  Eigen::Vector2d centre, direction;
  double half_span, half_width, underside;
  double ramp_lengths[2];
  double pillar_distance;  ///< of the pillars from the centre along `direction`
};
inline constexpr double kDeckThickness = 0.6;
inline constexpr double kRampSlope = 0.3;
[[nodiscard]] std::vector<Solid> make_overpass(const OverpassShape& shape, const Terrain& terrain);

}  // namespace vantage::simulation
