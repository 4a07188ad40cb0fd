#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hidden_point_removal.hpp"
#include "vantage/visibility.hpp"

namespace vantage::test {

/// What is asked of the operator beside the map and the viewpoint.
struct Question {
  hpr::Kernel kernel = hpr::Kernel::spherical_flip;
  double alpha = 100.0;
  double max_range = std::numeric_limits<double>::infinity();  ///< [m]

  [[nodiscard]] hpr::Settings settings(const Bounds3& bounds) const;
  [[nodiscard]] std::string params() const;  ///< of the plugin, TOML
};
[[nodiscard]] std::string to_string(const Question& question);

/// Something that says what is seen from a viewpoint.
using Answers = std::function<Result<IndexList>(const Point& viewpoint)>;

/// The function `hidden_point_removal`. Borrows the map.
[[nodiscard]] Answers by_function(PointsView map, const Bounds3& bounds, const Question& question);

/// A scene of the plugin `hpr`. Borrows the map.
[[nodiscard]] std::shared_ptr<const VisibilityScene> scene_of(PointsView map, const Bounds3& bounds,
                                                              const Question& question);
[[nodiscard]] Answers by_scene(std::shared_ptr<const VisibilityScene> scene);

/// The points that take part, 1e-30 m < |p~| <= max_range, and their p* (Eqs. 7, 8).
struct TurnedPoints {
  IndexList indices;
  std::vector<Point> turned;
  double farthest = 0.0;  ///< distance [m]
  bool at_one_place = true;
};
[[nodiscard]] TurnedPoints turned_points(PointsView map, const Point& viewpoint,
                                         const hpr::Settings& settings);

/// The stated rule: the points whose p* is a vertex of Conv(P* u {0}) in exact arithmetic.
/// Errors: `invalid_input` where a point that takes part is farther than R (flip, at least two
/// places).
[[nodiscard]] Result<IndexList> exactly_seen(PointsView map, const Point& viewpoint,
                                             const hpr::Settings& settings);

/// The union of `exactly_seen`; throws where one is an error.
[[nodiscard]] IndexList exactly_seen_from_any(PointsView map, std::span<const Point> viewpoints,
                                              const hpr::Settings& settings);

/// An answer for a large map beside Qhull's hull of all points. What they differ in is judged
/// exactly, point by point; where they agree nothing is checked.
struct Comparison {
  std::size_t seen = 0;
  std::size_t differences = 0;  ///< points that only one of them sees
  std::size_t for_us = 0;       ///< of these, judged as the answer says
  std::size_t for_qhull = 0;    ///< judged as Qhull says: errors of the answer
};
[[nodiscard]] Result<Comparison> compare_with_qhull(const IndexList& seen, PointsView map,
                                                    const Point& viewpoint,
                                                    const hpr::Settings& settings);

}  // namespace vantage::test
