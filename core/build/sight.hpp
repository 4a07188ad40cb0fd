#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <span>

#include "vantage/build/build.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"
#include "vantage/visibility.hpp"

namespace vantage {

/// V_ij of Eq. 10.
struct Observable {
  std::uint64_t seen = 0;   ///< points that at least one viewpoint sees
  ViewCounts kept = {};     ///< map points that enough viewpoints see; `views` only if stored
  std::size_t skipped = 0;  ///< viewpoints not evaluated, see `ViewpointParams::min_gain`
};

/// What the viewpoints of a region see (Sec. 2.3). Only this class calls the visibility plugin,
/// checks its answers, and applies `min_views` and `min_gain`. Region maps and the survey for
/// partitioners both use it.
/// Thread safety: const methods may run on one object from many threads at once.
class Sight {
 public:
  /// All arguments but the limits are borrowed.
  /// @param map     the wide-area map, or the part of it that decides about the viewpoints
  /// @param limits  of the wide-area map
  Sight(PointsView map, const VisibilityLimits& limits,
        const PluginPtr<VisibilityOperator>& visibility, const BuildParams& params)
      : map_(map), visibility_(visibility), params_(params), limits_(limits) {}

  [[nodiscard]] PointsView map() const noexcept { return map_; }

  /// Prepares the scene of the map with all threads, if regions are going to ask for it. Otherwise
  /// the first of them would, while the others wait.
  [[nodiscard]] Result<void> prepare() const;

  /// B_q of Eq. 9, among all points of the map.
  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const;

  /// V_ij of Eq. 10.
  /// @param inside    P_ij; used only with VisibilityScope::region
  /// @param progress  as for `VisibilityScene::visible_from_any`
  [[nodiscard]] Result<Observable> observable(std::span<const std::uint32_t> inside,
                                              std::span<const Point> viewpoints,
                                              const VisibilityProgress* progress) const {
    return look(inside, viewpoints, kAll, params_.views, progress);
  }

  /// The points of V_ij of Eq. 10, without the view counts that a region map may store.
  /// @param enough  evaluation may stop, with a part of them, above this number
  [[nodiscard]] Result<IndexList> seen(std::span<const std::uint32_t> inside,
                                       std::span<const Point> viewpoints,
                                       std::uint64_t enough) const {
    return look(inside, viewpoints, enough, false, nullptr).map([](Observable&& observable) {
      return std::move(observable.kept.points);
    });
  }

  /// Frees the scene of the map. Precondition: no query follows.
  void release() { map_scene_.reset(); }

 private:
  static constexpr std::uint64_t kAll = std::numeric_limits<std::uint64_t>::max();

  struct Scope;
  /// @param keep_views  whether the answer has the views of each point
  [[nodiscard]] Result<Observable> look(std::span<const std::uint32_t> inside,
                                        std::span<const Point> viewpoints, std::uint64_t enough,
                                        bool keep_views, const VisibilityProgress* progress) const;
  [[nodiscard]] Result<Scope> scope_of(std::span<const std::uint32_t> inside) const;
  [[nodiscard]] Result<PluginPtr<VisibilityScene>> scene_of(PointsView points) const;
  [[nodiscard]] Result<const VisibilityScene*> map_scene() const;
  [[nodiscard]] bool counts_views() const noexcept {
    return params_.min_views > 1 || params_.views;
  }

  PointsView map_;
  const PluginPtr<VisibilityOperator>& visibility_;
  const BuildParams& params_;
  VisibilityLimits limits_;
  mutable std::mutex mutex_;
  mutable PluginPtr<VisibilityScene> map_scene_;
};

}  // namespace vantage
