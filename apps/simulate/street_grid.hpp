#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "simulate/params.hpp"
#include "vantage/result.hpp"

namespace vantage::simulation {

/// Where the streets run: a grid whose crossings are slightly displaced. Streets are straight
/// between crossings and leave the campus at its borders. Campus frame [m].
///
/// Nodes are (i, j) with i in [-1, streets_x()] and j in [-1, streets_y()]: crossings inside, and
/// the ends of streets (and the corners) on the border.
class StreetGrid {
 public:
  StreetGrid(const CampusParams& params, std::uint64_t seed);

  [[nodiscard]] int streets_x() const noexcept { return count_[0]; }  ///< that cross the x axis
  [[nodiscard]] int streets_y() const noexcept { return count_[1]; }
  /// The undisturbed distance between neighbouring streets along x and y [m].
  [[nodiscard]] const Eigen::Vector2d& spacing() const noexcept { return spacing_; }
  [[nodiscard]] const Eigen::Vector2d& node(int i, int j) const noexcept;
  [[nodiscard]] bool is_border_x(int i) const noexcept { return i < 0 || i >= count_[0]; }
  [[nodiscard]] bool is_border_y(int j) const noexcept { return j < 0 || j >= count_[1]; }

  /// The crossings of a closed route, in driving order (see `drive.route`).
  /// Errors: `invalid_config` if the campus has too few streets for it.
  [[nodiscard]] Result<std::vector<Eigen::Vector2d>> route(int number) const;

  /// The routes that this grid has, 0 first.
  [[nodiscard]] std::vector<std::vector<Eigen::Vector2d>> routes() const;

  /// The distance from a point to the nearest middle of a street [m].
  [[nodiscard]] double distance_to_street(const Eigen::Vector2d& p) const noexcept;

 private:
  std::array<int, 2> count_;
  Eigen::Vector2d spacing_;
  std::vector<Eigen::Vector2d> nodes_;
};

}  // namespace vantage::simulation
