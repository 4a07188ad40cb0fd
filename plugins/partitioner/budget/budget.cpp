#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>

#include "vantage/kit/plan_cuts.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace {

using Eigen::Vector2d;
using vantage::ErrorCode, vantage::fail, vantage::PointsView, vantage::Result;
using vantage::PlanCut, vantage::PlanPart;

constexpr auto kExact = std::numeric_limits<std::uint64_t>::max();

vantage::Region region_of(const PlanPart& part) { return {part.label, part.box, {}}; }

/// Where to cut between `min` and `max` > `min`; above `min`, so that neither side is empty.
double middle_of(double min, double max) {
  const double middle = 0.5 * min + 0.5 * max;
  return min < middle && middle <= max ? middle : max;
}

std::string metres(double x) {
  char text[400];  // the longest double has 309 digits before the point
  std::snprintf(text, sizeof text, "%.2f", x);
  return text;
}
std::string place(const Vector2d& p) { return "(" + metres(p.x()) + ", " + metres(p.y()) + ")"; }

/// Cuts regions in half until what can be observed in each fits the budget.
struct Budget {
  std::uint64_t max_points{};
  double min_width = 2.0;

  static constexpr auto schema() {
    return std::tuple{
        vantage::required("max_points", &Budget::max_points, "",
                          "points that the observable map of a region may hold (|V_ij| of Eq. 10)",
                          vantage::at_least(1)),
        vantage::optional("min_width", &Budget::min_width, "m",
                          "no region is cut into pieces narrower than this",
                          vantage::non_negative)};
  }

  [[nodiscard]] Result<vantage::Partition> partition(const vantage::MapPasses& map, PointsView,
                                                     const vantage::MapSurvey& survey) const {
    return vantage::PlanCutter(map).cut_up(
        [&](const PlanPart& part) { return cut_to_budget(part, survey); },
        "max_points = " + std::to_string(max_points));
  }

 private:
  /// Nothing for a part that shows few enough points.
  [[nodiscard]] Result<std::optional<PlanCut>> cut_to_budget(
      const PlanPart& part, const vantage::MapSurvey& survey) const {
    VANTAGE_TRY(const auto seen, survey.observable_points(region_of(part), max_points));
    if (seen <= max_points) return std::nullopt;
    const auto cut = cut_in_the_middle(part);
    if (!cut) return over_budget(part, survey);
    return cut;
  }

  /// Across the points' longer side, across the other one where that cannot be.
  [[nodiscard]] std::optional<PlanCut> cut_in_the_middle(const PlanPart& part) const {
    const Vector2d &min = part.tight.min, &max = part.tight.max;
    for (const Eigen::Index axis : vantage::longer_first(max - min)) {
      if (min[axis] == max[axis]) continue;
      const double middle = middle_of(min[axis], max[axis]);
      if (const auto cut = vantage::cut_near(part, axis, middle, min_width)) return cut;
    }
    return std::nullopt;
  }

  [[nodiscard]] tl::unexpected<vantage::Error> over_budget(const PlanPart& part,
                                                           const vantage::MapSurvey& survey) const {
    auto seen = survey.observable_points(region_of(part), kExact);
    if (!seen) return fail(std::move(seen).error());
    return fail(ErrorCode::invalid_input,
                "the region from " + place(part.box.min) + " to " + place(part.box.max) +
                    " m shows " + std::to_string(*seen) +
                    " points, more than max_points = " + std::to_string(max_points) +
                    ", and cannot be cut into two that hold points and are min_width = " +
                    metres(min_width) + " m wide: raise max_points or lower visibility.max_range");
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, vantage::PartitionerOf<Budget>, "budget",
               "regions whose observable maps hold a limited number of points");
