#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "vantage/partition.hpp"
#include "vantage/result.hpp"

/// What partitioners share whose regions are boxes.
namespace vantage {

/// A partitioner makes no more regions than this.
inline constexpr std::size_t kMaxRegions = 1'000'000;

/// Error: `invalid_input`. @param cause  the parameter and its value: "max_points = 5"
[[nodiscard]] tl::unexpected<Error> too_many_regions(const std::string& cause);

/// The box that owns every place from `min` to `max`, both included: a HalfOpenBox ends one step
/// beyond what it owns [m].
[[nodiscard]] HalfOpenBox box_owning(const Eigen::Vector2d& min, const Eigen::Vector2d& max);

/// A part of the plan and the points in it, whose order means nothing.
/// @tparam Element  what stands for a point: its coordinates, or its index
template <class Element>
struct PlanPart {
  HalfOpenBox box;
  std::span<Element> points;
  std::string label = "cell";  ///< and one digit for each cut: 0 below, 1 above
};

/// What remains of a part on the two sides of a cut.
template <class Element>
struct PlanHalves {
  PlanPart<Element> below, above;
};

/// Cuts a part across one axis. Reorders its points.
/// @param at        where to cut [m]
/// @param is_below  whether an element lies below the cut
template <class Element, class IsBelow>
[[nodiscard]] PlanHalves<Element> halves_of(const PlanPart<Element>& part, Eigen::Index axis,
                                            double at, const IsBelow& is_below) {
  const auto above = std::partition(part.points.begin(), part.points.end(), is_below);
  const auto count = static_cast<std::size_t>(above - part.points.begin());
  const std::string path = part.label == "cell" ? "cell_" : part.label;
  PlanHalves<Element> halves{{part.box, part.points.first(count), path + "0"},
                             {part.box, part.points.subspan(count), path + "1"}};
  halves.below.box.max[axis] = at;
  halves.above.box.min[axis] = at;
  return halves;
}

/// The interval in which a box can be cut across an axis into two that are `min_width` wide [m];
/// nothing if there is none.
[[nodiscard]] std::optional<std::pair<double, double>> room_for_cut(const HalfOpenBox& box,
                                                                    Eigen::Index axis,
                                                                    double min_width);

/// The halves across the longer axis, or else across the other one.
/// @param size  what the longer axis is read from [m]
/// @param cut_across(axis)  an optional
template <class CutAcross>
[[nodiscard]] auto across_longer(const Eigen::Vector2d& size, const CutAcross& cut_across) {
  const Eigen::Index longer = size.x() >= size.y() ? 0 : 1;
  auto halves = cut_across(longer);
  return halves ? std::move(halves) : cut_across(1 - longer);
}

/// Cuts a part into two until none is to be cut; each that is left becomes a region.
/// @param cut    of one part: its halves, or nothing if the part becomes a region
/// @param cause  of too_many_regions
/// Errors: those of `cut`, too_many_regions and Partition::from.
template <class Element>
[[nodiscard]] Result<Partition> cut_up(
    PlanPart<Element> whole,
    const std::function<Result<std::optional<PlanHalves<Element>>>(const PlanPart<Element>&)>& cut,
    const std::string& cause) {
  std::vector<PlanPart<Element>> open{std::move(whole)};  // the next one last
  std::vector<Region> regions;
  while (!open.empty()) {
    PlanPart<Element> part = std::move(open.back());
    open.pop_back();
    VANTAGE_TRY(auto halves, cut(part));
    if (halves) {
      open.push_back(std::move(halves->above));
      open.push_back(std::move(halves->below));
      continue;
    }
    if (regions.size() == kMaxRegions) return too_many_regions(cause);
    regions.push_back(
        {.label = std::move(part.label), .footprint = std::move(part.box), .height = {}});
  }
  return Partition::from(std::move(regions));
}

}  // namespace vantage
