#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

#include "vantage/partition.hpp"
#include "vantage/result.hpp"

namespace vantage::grid_pcd {

inline constexpr const char* kMetaData = "grid_meta_data.yaml";

/// What `grid_meta_data.yaml` says of the grid.
struct MetaData {
  double grid_size = 0.0;                         ///< L of Eq. 2 [m]
  Eigen::Vector2d min = Eigen::Vector2d::Zero();  ///< of the ground, where cell (0, 0) begins [m]
  Eigen::Vector2d max = Eigen::Vector2d::Zero();  ///< of the ground [m]

  /// The cell of these indices. Neighbours use the same numbers for the edge between them.
  [[nodiscard]] HalfOpenBox cell(std::uint32_t i, std::uint32_t j) const;
  /// How many cells the grid may have along each axis, as whole numbers. The file rounds its
  /// corners to six digits, so a cell that begins within the rounding of `max` counts.
  [[nodiscard]] Eigen::Vector2d most_cells() const;
};

/// Reads the file's text.
/// Errors: `corrupt_data` at the line of an unknown, repeated or missing key or a wrong number.
/// @param file  the file's name in error messages
[[nodiscard]] Result<MetaData> parse_meta_data(std::string_view text, const std::string& file);

}  // namespace vantage::grid_pcd
