#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "vantage/plugin.hpp"

namespace {

using vantage::ErrorCode, vantage::fail, vantage::IndexList, vantage::Point, vantage::PointsView,
    vantage::Result, vantage::VisibilityLimits, vantage::VisibilityOperator,
    vantage::VisibilityProgress, vantage::VisibilityScene;

class Scene final : public VisibilityScene {
 public:
  Scene(PointsView map, double max_range) noexcept
      : VisibilityScene(map.size()), map_(map), max_range_(max_range) {}

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
      // Neighbours in the map are mostly seen from the same viewpoint: the last one goes first.
      const Point* last = &viewpoints.front();
      IndexList kept;
      for (std::uint32_t i = 0; i < map_.size(); ++i) {
        if (!within_reach(map_[i], *last)) {
          const auto seen_from = std::find_if(
              viewpoints.begin(), viewpoints.end(),
              [&](const Point& viewpoint) { return within_reach(map_[i], viewpoint); });
          if (seen_from == viewpoints.end()) continue;
          last = &*seen_from;
        }
        kept.push_back(i);
      }
      // Points were gone through, not viewpoints: all of them are done only now.
      if (progress != nullptr) progress->advanced(viewpoints.size());
      return kept;
    });
  }

 private:
  [[nodiscard]] bool within_reach(const Point& p, const Point& viewpoint) const {
    return p != viewpoint && (p - viewpoint).norm() <= max_range_;
  }

  PointsView map_;
  double max_range_;
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
