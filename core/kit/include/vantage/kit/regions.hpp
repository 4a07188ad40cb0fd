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

/// Shared by partitioners whose regions are boxes; and the region nearest to a place.
namespace vantage {

/// The region whose footprint is nearest to a place (the lowest id if several are equally near);
/// the one that owns the place, if any does. None if there is no region, or for a place that is not
/// finite. Takes time in proportion to the number of regions.
[[nodiscard]] std::optional<RegionId> nearest_region(const Partition& partition,
                                                     const Eigen::Vector2d& xy);

/// The largest number of regions that a partitioner makes.
inline constexpr std::size_t kMaxRegions = 1'000'000;

/// The error of a partitioner that would exceed kMaxRegions: `invalid_input`.
/// @param cause  the parameter and its value: "max_points = 5"
[[nodiscard]] tl::unexpected<Error> too_many_regions(const std::string& cause);

/// The box that owns every place from `min` to `max` [m], both included. It ends at the next larger
/// double, because a HalfOpenBox does not own its end.
[[nodiscard]] HalfOpenBox box_owning(const Eigen::Vector2d& min, const Eigen::Vector2d& max);

/// A part of the plan and the points in it, in any order.
/// @tparam Element  represents a point: its coordinates, or its index
template <class Element>
struct PlanPart {
  HalfOpenBox box;
  std::span<Element> points;
  std::string label = "cell";  ///< after cuts, "cell_" and one digit per cut: 0 below, 1 above
};

/// The two parts on the two sides of a cut.
template <class Element>
struct PlanHalves {
  PlanPart<Element> below, above;
};

/// Cuts a part in two across an axis. Reorders its points.
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

/// The interval [m] in which a cut across an axis leaves two boxes of at least `min_width` [m];
/// none if the box is too narrow.
[[nodiscard]] std::optional<std::pair<double, double>> room_for_cut(const HalfOpenBox& box,
                                                                    Eigen::Index axis,
                                                                    double min_width);

/// Cuts across the longer axis or, if that gives nothing, across the other one.
/// @param size        extents along the two axes [m]
/// @param cut_across  cut_across(axis) returns an optional
template <class CutAcross>
[[nodiscard]] auto across_longer(const Eigen::Vector2d& size, const CutAcross& cut_across) {
  const Eigen::Index longer = size.x() >= size.y() ? 0 : 1;
  auto halves = cut_across(longer);
  return halves ? std::move(halves) : cut_across(1 - longer);
}

/// Cuts parts in two until no part needs a cut. Each remaining part becomes a region.
/// @param cut    returns the halves of a part, or nothing if the part becomes a region
/// @param cause  see too_many_regions
/// Errors: those of `cut`, too_many_regions and Partition::from.
template <class Element>
[[nodiscard]] Result<Partition> cut_up(
    PlanPart<Element> whole,
    const std::function<Result<std::optional<PlanHalves<Element>>>(const PlanPart<Element>&)>& cut,
    const std::string& cause) {
  std::vector<PlanPart<Element>> open{std::move(whole)};  // the next part to cut is the last
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
