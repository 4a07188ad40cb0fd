#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/regions.hpp"

namespace {

using Eigen::Vector2d;
using vantage::PointsView, vantage::Result;
using Part = vantage::PlanPart<Vector2d>;
using Halves = vantage::PlanHalves<Vector2d>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The points in plan. -0 becomes 0: they are one place, so a cut there must be one number.
std::vector<Vector2d> plan_of(PointsView map) {
  std::vector<Vector2d> plan;
  plan.reserve(map.size());
  for (const vantage::Point& p : map) plan.emplace_back(p.x() + 0.0, p.y() + 0.0);
  return plan;
}

/// The tightest box that owns all points.
vantage::HalfOpenBox box_of(std::span<const Vector2d> points) {
  Vector2d min = points.front(), max = points.front();
  for (const Vector2d& p : points) {
    min = min.cwiseMin(p);
    max = max.cwiseMax(p);
  }
  return vantage::box_owning(min, max);
}

/// The coordinate of a point that has points below it and divides the points most evenly; none if
/// all coordinates are equal. Reorders the points.
std::optional<double> median_cut(std::span<Vector2d> points, Eigen::Index axis) {
  const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
  std::nth_element(points.begin(), middle, points.end(),
                   [&](const Vector2d& a, const Vector2d& b) { return a[axis] < b[axis]; });
  const double median = (*middle)[axis];
  // Equal coordinates stay together, so the cut is at the median or at the next greater coordinate.
  const auto below = static_cast<std::size_t>(
      std::count_if(points.begin(), middle, [&](const Vector2d& p) { return p[axis] < median; }));
  double next = kInfinity;
  std::size_t below_next = points.size() / 2;
  for (auto p = middle; p != points.end(); ++p) {
    if ((*p)[axis] > median) {
      next = std::min(next, (*p)[axis]);
    } else {
      ++below_next;
    }
  }
  const bool at_median = below > 0, at_next = next < kInfinity;
  if (!at_median && !at_next) return std::nullopt;
  if (!at_median) return next;
  if (!at_next) return median;
  return points.size() - 2 * below <= 2 * below_next - points.size() ? median : next;
}

/// Median cuts until a cell holds few enough points.
struct KdSplit {
  std::uint64_t max_points{};
  double min_width = 0.0;

  static constexpr auto schema() {
    return std::tuple{
        vantage::required("max_points", &KdSplit::max_points, "",
                          "a cell with more map points than this is cut", vantage::at_least(1)),
        vantage::optional("min_width", &KdSplit::min_width, "m",
                          "no cell is cut into pieces narrower than this", vantage::non_negative)};
  }

  [[nodiscard]] Result<vantage::Partition> partition(PointsView map, PointsView,
                                                     const vantage::MapSurvey&) const {
    std::vector<Vector2d> plan = plan_of(map);
    return vantage::cut_up<Vector2d>(
        {box_of(plan), plan}, [&](const Part& part) { return cut(part); },
        "max_points = " + std::to_string(max_points));
  }

 private:
  /// None if the part is small enough or cannot be cut.
  [[nodiscard]] std::optional<Halves> cut(const Part& part) const {
    if (part.points.size() <= max_points) return std::nullopt;
    return vantage::across_longer(part.box.max - part.box.min,
                                  [&](Eigen::Index axis) { return cut_across(part, axis); });
  }

  [[nodiscard]] std::optional<Halves> cut_across(const Part& part, Eigen::Index axis) const {
    const auto room = vantage::room_for_cut(part.box, axis, min_width);
    if (!room) return std::nullopt;
    const std::optional<double> median = median_cut(part.points, axis);
    if (!median) return std::nullopt;
    const double at = std::clamp(*median, room->first, room->second);
    Halves halves =
        vantage::halves_of(part, axis, at, [&](const Vector2d& p) { return p[axis] < at; });
    if (halves.below.points.empty() || halves.above.points.empty()) return std::nullopt;
    return halves;
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, vantage::PartitionerOf<KdSplit>, "kd_split",
               "median cuts until a cell holds few enough points");
