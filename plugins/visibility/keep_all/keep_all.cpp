#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "point_buckets.hpp"
#include "vantage/plugin.hpp"

namespace {

using vantage::Bounds3, vantage::ErrorCode, vantage::fail, vantage::IndexList, vantage::Point,
    vantage::PointBuckets, vantage::PointsView, vantage::Result, vantage::VisibilityLimits,
    vantage::VisibilityOperator, vantage::VisibilityProgress, vantage::VisibilityScene;

/// A set of points of one map, with one bit each.
class PointSet {
 public:
  explicit PointSet(std::size_t map_size) : words_((map_size + 63) / 64) {}

  /// Precondition: i is not in the set.
  void insert(std::uint32_t i) {
    words_[i / 64] |= std::uint64_t{1} << (i % 64);
    ++size_;
  }

  [[nodiscard]] IndexList ascending() const {
    IndexList indices;
    indices.reserve(size_);
    for (std::size_t w = 0; w < words_.size(); ++w) {
      for (std::uint64_t rest = words_[w]; rest != 0; rest &= rest - 1) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(rest));
        indices.push_back(static_cast<std::uint32_t>(64 * w + bit));
      }
    }
    return indices;
  }

 private:
  std::vector<std::uint64_t> words_;
  std::size_t size_ = 0;
};

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

class Scene final : public VisibilityScene {
 public:
  Scene(PointsView map, double max_range)
      : VisibilityScene(map.size()), map_(map), max_range_(max_range) {
    if (std::isfinite(max_range)) buckets_.emplace(map, std::max(kWidth, max_range / kAcross));
  }

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return visible_from_any({&viewpoint, 1}, nullptr);
  }

  [[nodiscard]] Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress) const noexcept override {
    return vantage::guarded([&]() -> Result<IndexList> {
      for (const Point& viewpoint : viewpoints) {
        if (!viewpoint.allFinite()) {
          return fail(ErrorCode::invalid_input, "a viewpoint has a coordinate that is not finite");
        }
      }
      if (viewpoints.empty()) return IndexList{};
      IndexList kept = buckets_ ? seen_within_range({viewpoints.begin(), viewpoints.end()})
                                : seen_without_limit(map_, viewpoints);
      // The loop runs over points, not viewpoints, so all viewpoints are done only now.
      if (progress != nullptr) progress->advanced(viewpoints.size());
      return kept;
    });
  }

 private:
  static constexpr double kWidth = 2.0;    // of a bucket [m], at least
  static constexpr double kAcross = 16.0;  // buckets in a range, at most

  /// Which viewpoints see points of a bucket: one sees all of them, or each of `undecided` may see
  /// some.
  struct Sight {
    bool of_all = false;
    std::vector<Point> undecided = {};
  };

  [[nodiscard]] IndexList seen_within_range(std::vector<Point> viewpoints) const {
    const Bounds3 around = vantage::bounds_of(viewpoints);
    PointSet kept(map_.size());
    for (const PointBuckets::Bucket& bucket : buckets_->all()) {
      if (!in_range(gap(bucket.bounds, around))) continue;
      Sight sight = sight_of(bucket.bounds, viewpoints);
      if (!sight.of_all && sight.undecided.empty()) continue;
      for (const std::uint32_t i : buckets_->indices(bucket)) {
        if (sight.of_all || seen_from_any(map_[i], sight.undecided)) kept.insert(i);
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
  std::optional<PointBuckets> buckets_;  // none without a limit
};

/// Every point within reach is observable: the wide-area map as the paper's baseline.
class KeepAll final : public VisibilityOperator {
 public:
  using Params = vantage::NoParams;

  [[nodiscard]] static Result<std::unique_ptr<VisibilityOperator>> create(const Params&) {
    return std::make_unique<KeepAll>();
  }

  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept override {
    return vantage::guarded([&]() -> Result<std::unique_ptr<VisibilityScene>> {
      VANTAGE_CHECK(vantage::check_points(map, "the map"));
      if (!(limits.max_range > 0.0)) {
        return fail(ErrorCode::invalid_input, "max_range must be > 0 m");
      }
      return std::make_unique<Scene>(map, limits.max_range);
    });
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::VisibilityOperator, KeepAll, "keep_all",
               "every point within the sensor's reach (the wide-area map)");
