#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::benchmarks {

/// What an operator selects beside what is truly seen: from one viewpoint, or added up over
/// several.
struct Score {
  std::size_t map = 0, selected = 0, seen = 0, hits = 0;  ///< points; hits: selected and seen

  Score& operator+=(const Score& more) noexcept;
  /// Of the map that is selected, of the seen points that are selected, of the selected that are
  /// seen: 0 to 1, 0 of nothing.
  [[nodiscard]] double share() const noexcept;
  [[nodiscard]] double recall() const noexcept;
  [[nodiscard]] double precision() const noexcept;
};

/// @param selected, seen  strictly ascending
[[nodiscard]] Score score_of(std::span<const std::uint32_t> selected,
                             std::span<const std::uint32_t> seen, std::size_t map_size);

/// What one setting of an operator gives, 0 to 1 each.
struct RecallMark {
  double share, recall;
};

/// The least share of the map at which a recall is reached, on the straight lines from (0, 0)
/// through the marks in the order of their shares. A place on such a line can be had: points drawn
/// at random from what its two ends select have that share and that recall.
/// @return  nothing where no mark has that recall
[[nodiscard]] std::optional<double> share_at(double recall, std::vector<RecallMark> marks);

/// The recalls, in whole percent from 1, that `a` reaches with a smaller share than `b`, or reaches
/// alone: first and last of each run.
[[nodiscard]] std::vector<std::pair<int, int>> recalls_with_less(const std::vector<RecallMark>& a,
                                                                 const std::vector<RecallMark>& b);

/// The points of the map nearer than `radius` [m] to a point of a scan, strictly ascending.
/// @param scan  map frame [m]
[[nodiscard]] IndexList points_near(PointsView map, PointsView scan, double radius);

/// Whether a map point belongs to the surface that a ray towards it meets first: it lies before
/// that surface, or at most 3 m behind it along the ray and 7 cm behind its plane. A simulated map
/// has 2 cm of noise, cut off at three standard deviations.
/// @param distance       from the viewpoint to the point [m]
/// @param hit_range      from the viewpoint to the surface [m]
/// @param cos_incidence  of the angle between ray and normal
[[nodiscard]] bool is_on_first_surface(double distance, double hit_range,
                                       double cos_incidence) noexcept;

}  // namespace vantage::benchmarks
