#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "vantage/kit/index_set.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/point_grid.hpp"
#include "vantage/kit/scene_by_viewpoint.hpp"
#include "vantage/kit/visibility_checks.hpp"

namespace {

using vantage::Bounds3, vantage::IndexList, vantage::Point, vantage::PointGrid, vantage::PointsView,
    vantage::Result, vantage::SceneByViewpoint, vantage::VisibilityLimits,
    vantage::VisibilityProgress, vantage::VisibilityScene;

/// Bounds on |p - q| for any p in `a` and q in `b`: axis by axis, at least `gap` and at most
/// `span`. Rounding never changes the order of differences, squares, sums and roots, so the bounds
/// hold bit for bit.
Point gap(const Bounds3& a, const Bounds3& b) {
  return (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(Point::Zero());
}
Point span(const Bounds3& a, const Bounds3& b) { return (a.max - b.min).cwiseMax(b.max - a.min); }

/// All points except those at the place of the only viewpoint; with viewpoints at two places, all
/// points.
IndexList seen_without_limit(PointsView map, std::span<const Point> viewpoints) {
  const Point& first = viewpoints.front();
  const bool one_place = std::all_of(viewpoints.begin(), viewpoints.end(),
                                     [&](const Point& viewpoint) { return viewpoint == first; });
  IndexList kept;
  kept.reserve(map.size());
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    if (!one_place || map[i] != first) kept.push_back(i);
  }
  return kept;
}

class Scene final : public SceneByViewpoint {
 public:
  Scene(PointsView map, double max_range)
      : SceneByViewpoint(map.size()), map_(map), max_range_(max_range) {
    if (std::isfinite(max_range)) grid_.emplace(map, std::max(kWidth, max_range / kAcross));
  }

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return visible_from_any({&viewpoint, 1}, nullptr);
  }

  [[nodiscard]] Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress) const noexcept override {
    return vantage::guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(vantage::check_viewpoints(viewpoints));
      if (viewpoints.empty()) return IndexList{};
      IndexList kept = grid_ ? seen_within_range({viewpoints.begin(), viewpoints.end()})
                             : seen_without_limit(map_, viewpoints);
      // Points were gone through, not viewpoints: all of them are done only now.
      if (progress != nullptr) progress->advanced(viewpoints.size());
      return kept;
    });
  }

 private:
  static constexpr double kWidth = 2.0;    // of a cell [m], at least
  static constexpr double kAcross = 16.0;  // cells in a range, at most

  /// Who sees points of a cell: one all of them, or each of `undecided` perhaps some.
  struct Sight {
    bool of_all = false;
    std::vector<Point> undecided = {};
  };

  [[nodiscard]] IndexList seen_within_range(std::vector<Point> viewpoints) const {
    const Bounds3 around = vantage::bounds_of(viewpoints);
    vantage::IndexSet kept(map_.size());
    IndexList some;
    for (const PointGrid::Cell& cell : grid_->cells()) {
      if (!in_range(gap(cell.bounds, around))) continue;
      Sight sight = sight_of(cell.bounds, viewpoints);
      if (sight.of_all) {
        kept.add(grid_->indices(cell));
      } else if (!sight.undecided.empty()) {
        some.clear();
        for (const std::uint32_t i : grid_->indices(cell)) {
          if (seen_from_any(map_[i], sight.undecided)) some.push_back(i);
        }
        kept.add(some);
      }
    }
    return kept.ascending();
  }

  /// Moves the viewpoint that sees all to the front, because it usually sees all of the next box.
  [[nodiscard]] Sight sight_of(const Bounds3& box, std::span<Point> viewpoints) const {
    std::vector<Point> undecided;
    for (Point& viewpoint : viewpoints) {
      const Bounds3 here{viewpoint, viewpoint};
      const Point least = gap(box, here);
      if (!in_range(least)) continue;
      // A point within the box may be at the viewpoint's own place, where it is not seen.
      if (!least.isZero(0.0) && in_range(span(box, here))) {
        std::swap(viewpoints.front(), viewpoint);
        return {.of_all = true};
      }
      undecided.push_back(viewpoint);
    }
    return {.undecided = std::move(undecided)};
  }

  /// Moves the viewpoint that sees `p` to the front, because it usually sees the next point, too.
  [[nodiscard]] bool seen_from_any(const Point& p, std::span<Point> viewpoints) const {
    const auto sees = std::find_if(
        viewpoints.begin(), viewpoints.end(),
        [&](const Point& viewpoint) { return p != viewpoint && in_range(p - viewpoint); });
    if (sees == viewpoints.end()) return false;
    std::iter_swap(viewpoints.begin(), sees);
    return true;
  }

  [[nodiscard]] bool in_range(const Point& offset) const { return offset.norm() <= max_range_; }

  PointsView map_;
  double max_range_;
  std::optional<PointGrid> grid_;  // none without a limit
};

/// Every point within reach is observable: the wide-area map as the paper's baseline.
struct Params {
  static constexpr auto schema() { return vantage::NoParams::schema(); }

  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const {
    VANTAGE_CHECK(vantage::check_map(map, limits));
    return std::make_unique<Scene>(map, limits.max_range);
  }

  [[nodiscard]] static double reach(const VisibilityLimits& limits) { return limits.max_range; }
};

}  // namespace

VANTAGE_PLUGIN(vantage::VisibilityOperator, vantage::VisibilityOperatorOf<Params>, "keep_all",
               "every point within the sensor's reach (the wide-area map)");
