#pragma once

#include <cstdint>

#include "vantage/kit/map_parts.hpp"
#include "vantage/plugin.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Points in memory as a map of one part, which is a view of them.
class MapInMemory final : public MapParts {
 public:
  /// @param points  borrowed
  explicit MapInMemory(PointsView points) noexcept : points_(points), bounds_(bounds_of(points)) {}
  [[nodiscard]] Bounds3 bounds() const noexcept override { return bounds_; }
  [[nodiscard]] std::uint64_t points() const noexcept override { return points_.size(); }
  [[nodiscard]] Result<void> pass(MapVisitor& visitor) const noexcept override {
    return visitor.see(points_);
  }
  [[nodiscard]] Result<PointsView> in_memory() const noexcept override { return points_; }
  [[nodiscard]] std::uint64_t points_in(const Bounds2&) const override { return points_.size(); }
  [[nodiscard]] Result<MapPart> read(const Bounds2&) const override { return MapPart(points_); }

 private:
  PointsView points_;
  Bounds3 bounds_;
};

/// All points of a map. Errors: those of the map.
[[nodiscard]] inline Result<PointCloud> points_of(const MapPasses& map) {
  class All final : public MapVisitor {
   public:
    explicit All(std::uint64_t points) { all.reserve(points); }
    [[nodiscard]] Result<void> see(PointsView points) noexcept override {
      return guarded([&]() -> Result<void> {
        all.insert(all.end(), points.begin(), points.end());
        return {};
      });
    }
    PointCloud all;
  };
  All visitor(map.points());
  VANTAGE_CHECK(map.pass(visitor));
  return std::move(visitor.all);
}

}  // namespace vantage
