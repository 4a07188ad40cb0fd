#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/regions.hpp"

namespace {

using Eigen::Vector2d;
using vantage::ErrorCode, vantage::fail, vantage::PointsView, vantage::Result;
using Part = vantage::PlanPart<std::uint32_t>;  // points as indices into the map
using Halves = vantage::PlanHalves<std::uint32_t>;

constexpr std::size_t kMaxLabel = 200;  // of a Region; a path of cuts so long has run into a corner
constexpr auto kExact = std::numeric_limits<std::uint64_t>::max();

vantage::Region region_of(const Part& part) { return {part.label, part.box, {}}; }

/// Both ends included.
struct TightBox {
  Vector2d min, max;
};

/// The map in plan view. -0 becomes 0: both are the same place, so a cut there must be one number.
class Plan {
 public:
  explicit Plan(PointsView map) noexcept : map_(map) {}
  [[nodiscard]] Vector2d operator[](std::uint32_t k) const noexcept {
    return {map_[k].x() + 0.0, map_[k].y() + 0.0};
  }
  [[nodiscard]] double along(Eigen::Index axis, std::uint32_t k) const noexcept {
    return map_[k][axis] + 0.0;
  }

  [[nodiscard]] TightBox tight_box_of(std::span<const std::uint32_t> points) const {
    TightBox box{(*this)[points.front()], (*this)[points.front()]};
    for (const std::uint32_t k : points) {
      const Vector2d p = (*this)[k];
      box.min = box.min.cwiseMin(p);
      box.max = box.max.cwiseMax(p);
    }
    return box;
  }

 private:
  PointsView map_;
};

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

  [[nodiscard]] Result<vantage::Partition> partition(PointsView map, PointsView,
                                                     const vantage::MapSurvey& survey) const {
    const Plan plan(map);
    std::vector<std::uint32_t> points(map.size());
    std::iota(points.begin(), points.end(), 0U);
    const TightBox tight = plan.tight_box_of(points);
    return vantage::cut_up<std::uint32_t>(
        {vantage::box_owning(tight.min, tight.max), points},
        [&](const Part& part) { return cut_to_budget(plan, part, survey); },
        "max_points = " + std::to_string(max_points));
  }

 private:
  /// Nothing for a part that shows few enough points.
  [[nodiscard]] Result<std::optional<Halves>> cut_to_budget(
      const Plan& plan, const Part& part, const vantage::MapSurvey& survey) const {
    VANTAGE_TRY(const auto seen, survey.observable_points(region_of(part), max_points));
    if (seen <= max_points) return std::nullopt;
    auto halves = cut(plan, part);
    if (!halves) return over_budget(part, survey);
    return halves;
  }

  /// In the middle of the points' longer side, of the other one where that cannot be.
  [[nodiscard]] std::optional<Halves> cut(const Plan& plan, const Part& part) const {
    const TightBox tight = plan.tight_box_of(part.points);
    return vantage::across_longer(tight.max - tight.min, [&](Eigen::Index axis) {
      return cut_across(plan, part, tight, axis);
    });
  }

  [[nodiscard]] std::optional<Halves> cut_across(const Plan& plan, const Part& part,
                                                 const TightBox& tight, Eigen::Index axis) const {
    const auto room = vantage::room_for_cut(part.box, axis, min_width);
    if (!room || tight.min[axis] == tight.max[axis]) return std::nullopt;
    const double at =
        std::clamp(middle_of(tight.min[axis], tight.max[axis]), room->first, room->second);
    if (at <= tight.min[axis] || at > tight.max[axis]) return std::nullopt;
    if (part.label.size() >= kMaxLabel) return std::nullopt;
    return vantage::halves_of(part, axis, at,
                              [&](std::uint32_t k) { return plan.along(axis, k) < at; });
  }

  [[nodiscard]] tl::unexpected<vantage::Error> over_budget(const Part& part,
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
