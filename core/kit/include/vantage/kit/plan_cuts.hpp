#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "vantage/map_passes.hpp"
#include "vantage/partition.hpp"
#include "vantage/result.hpp"

/// Regions that are boxes: the map is cut in two, and its parts again, until no part needs a cut.
namespace vantage {

/// A box of the plan that holds points of the map.
struct PlanPart {
  HalfOpenBox box;
  Bounds2 tight;               ///< the tightest rectangle around its points [m]
  std::uint64_t points = 0;    ///< > 0
  std::string label = "cell";  ///< after cuts, "cell_" and one digit per cut: 0 below, 1 above
};

/// Points below `at` [m] come to one side, those at it and above to the other.
struct PlanCut {
  Eigen::Index axis = 0;
  double at = 0.0;
};

/// Whether a cut across an axis can leave two boxes of at least `min_width` [m].
[[nodiscard]] bool has_room(const PlanPart& part, Eigen::Index axis, double min_width) noexcept;

/// The cut across an axis that is nearest to `wanted` [m] and leaves two boxes of at least
/// `min_width` [m]; none if there is no such cut, if a side would hold no point, or if the labels
/// would be too long for a region.
[[nodiscard]] std::optional<PlanCut> cut_near(const PlanPart& part, Eigen::Index axis,
                                              double wanted, double min_width);

/// Both axes, that of the longer extent [m] first; x if they are equal.
[[nodiscard]] std::array<Eigen::Index, 2> longer_first(const Eigen::Vector2d& size) noexcept;

/// How many points of a map that is not in memory are gathered at a time: 24 bytes each while a
/// median is sought, 16 otherwise.
inline constexpr std::uint64_t kPointsGathered = std::uint64_t{1} << 22U;

/// Cuts a map of any size. A part whose points can be gathered is cut in memory; the points of a
/// larger one are passed over. Both give the same parts.
class PlanCutter {
 public:
  /// @param map     borrowed; has points, all of them finite
  /// @param gather  how many points may be gathered at a time; a map in memory is gathered whole
  explicit PlanCutter(const MapPasses& map, std::uint64_t gather = kPointsGathered);
  ~PlanCutter();

  /// Where a part is cut, or nothing if it becomes a region. It may ask for `median_cut`.
  using Where = std::function<Result<std::optional<PlanCut>>(const PlanPart&)>;

  /// Cuts until no part needs a cut. Regions are in the order of their labels.
  /// @param cause  see too_many_regions
  /// Errors: those of `where` and of the map, too_many_regions, and Partition::from.
  [[nodiscard]] Result<Partition> cut_up(const Where& where, const std::string& cause);

  /// The coordinate of a point that has points below it and divides the points most evenly; none if
  /// all coordinates are equal. Of the part that `where` is asked about. Errors: those of the map.
  [[nodiscard]] Result<std::optional<double>> median_cut(Eigen::Index axis) const;

 private:
  class Points;
  std::unique_ptr<Points> points_;
};

}  // namespace vantage
