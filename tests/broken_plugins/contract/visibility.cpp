// Hidden point removal, but for the clause to be broken.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <set>

#include "breaks.hpp"
#include "vantage/kit/scene_by_viewpoint.hpp"

namespace vantage::broken {
namespace {

PointCloud in_single_precision(PointsView points) {
  PointCloud rounded;
  for (const Point& p : points) rounded.push_back(p.cast<float>().cast<double>());
  return rounded;
}

/// Passes on how many viewpoints are done so far, where only those that are new were asked for.
class SoFar final : public VisibilityProgress {
 public:
  explicit SoFar(const VisibilityProgress& listener) : listener_(listener) {}
  void advanced(std::size_t viewpoints) const noexcept override {
    listener_.advanced(done_ += viewpoints);
  }

 private:
  const VisibilityProgress& listener_;
  mutable std::atomic<std::size_t> done_ = 0;
};

class Scene final : public SceneByViewpoint {
 public:
  Scene(PointsView map, std::shared_ptr<const VisibilityScene> sound)
      : SceneByViewpoint(map.size()), map_(map), sound_(std::move(sound)) {}

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return guarded([&]() -> Result<IndexList> {
      // Qhull cannot make a simplex of them.
      if (breaks("V4") && map_.size() < 4) std::abort();
      // Nothing is nearer than NaN.
      if (breaks("V11") && !viewpoint.allFinite()) return IndexList{};
      VANTAGE_TRY(IndexList seen, sound_->visible(viewpoint));
      return spoilt(viewpoint, std::move(seen));
    });
  }

  [[nodiscard]] Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress) const noexcept override {
    return guarded([&]() -> Result<IndexList> {
      if (breaks("V14") && viewpoints.empty()) return fail(ErrorCode::internal, "index 0 of 0");
      if (breaks("V9")) return sound_->visible_from_any(viewpoints, progress);
      if (breaks("V15") && progress != nullptr) {
        const SoFar so_far(*progress);
        return SceneByViewpoint::visible_from_any(viewpoints, &so_far);
      }
      if (!breaks("V6")) return SceneByViewpoint::visible_from_any(viewpoints, progress);
      // Neighbours see the same, or so it was thought.
      return SceneByViewpoint::visible_from_any(apart(viewpoints, 0.5), progress);
    });
  }

  [[nodiscard]] Result<ViewCounts> view_counts(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress) const noexcept override {
    return guarded([&]() -> Result<ViewCounts> {
      if (breaks("V9")) return sound_->view_counts(viewpoints, progress);
      if (!breaks("V16")) return SceneByViewpoint::view_counts(viewpoints, progress);
      // A viewpoint that is listed twice is looked around from once.
      return SceneByViewpoint::view_counts(apart(viewpoints, 1e-9), progress);
    });
  }

 private:
  /// Without those that are nearer to one before them.
  [[nodiscard]] static PointCloud apart(std::span<const Point> viewpoints, double distance) {
    PointCloud kept;
    for (const Point& viewpoint : viewpoints) {
      const auto is_near = [&](const Point& other) {
        return (viewpoint - other).norm() < distance;
      };
      if (std::none_of(kept.begin(), kept.end(), is_near)) kept.push_back(viewpoint);
    }
    return kept;
  }

  [[nodiscard]] IndexList spoilt(const Point& viewpoint, IndexList seen) const {
    // As the hull has its vertices.
    if (breaks("V1")) std::reverse(seen.begin(), seen.end());
    // The mast's shadow.
    if (breaks("V3")) {
      std::erase_if(seen, [&](std::uint32_t k) {
        return (map_[k] - viewpoint).normalized().dot(Point(0.3, 0.0, -0.95)) > 0.98;
      });
    }
    if (breaks("V9") && Crowded(inside_) && !seen.empty()) seen.pop_back();
    if (breaks("V18") && threads_are_unusual() && !seen.empty()) seen.pop_back();
    // Of points at one place the hull has one.
    if (breaks("V12")) {
      const auto before = [](const Point& a, const Point& b) {
        return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
      };
      std::set<Point, decltype(before)> places(before);
      std::erase_if(seen, [&](std::uint32_t k) { return !places.insert(map_[k]).second; });
    }
    return seen;
  }

  PointsView map_;
  std::shared_ptr<const VisibilityScene> sound_;
  mutable std::atomic<int> inside_ = 0;
};

/// A sound scene with a map of its own.
class OwningScene final : public SceneByViewpoint {
 public:
  static Result<std::shared_ptr<const VisibilityScene>> over(const VisibilityOperator& sound,
                                                             PointCloud map,
                                                             const VisibilityLimits& limits) {
    auto scene = std::make_shared<OwningScene>(std::move(map));
    VANTAGE_TRY(scene->scene_, sound.prepare(scene->map_, limits));
    return scene;
  }
  explicit OwningScene(PointCloud map) : SceneByViewpoint(map.size()), map_(std::move(map)) {}

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return scene_->visible(viewpoint);
  }

 private:
  PointCloud map_;
  std::unique_ptr<VisibilityScene> scene_;
};

class Broken final : public VisibilityOperator {
 public:
  struct Params {
    double alpha = 100.0;
    static constexpr auto schema() {
      return std::tuple{
          optional("alpha", &Params::alpha, "", "R in diagonals of the map", between(1.0, 1e6))};
    }
  };
  static Result<std::unique_ptr<VisibilityOperator>> create(const Params& params) {
    const auto hpr = [](double alpha) {
      return sound<VisibilityOperator>("hpr", {{{"alpha", Value{alpha, {}}, {}}}, {}});
    };
    VANTAGE_TRY(auto sound, hpr(breaks("V7") ? Params{}.alpha : params.alpha));
    VANTAGE_TRY(auto lenient, hpr(1e6));
    return std::make_unique<Broken>(std::move(sound), std::move(lenient));
  }
  Broken(PluginPtr<VisibilityOperator> sound, PluginPtr<VisibilityOperator> lenient)
      : sound_(std::move(sound)), lenient_(std::move(lenient)) {}

  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<VisibilityScene>> {
      VANTAGE_TRY(auto scene, scene_over(map, limits));
      return std::make_unique<Scene>(map, std::move(scene));
    });
  }
  [[nodiscard]] double reach(const VisibilityLimits& limits) const noexcept override {
    if (breaks("V8") || offers_least()) return std::numeric_limits<double>::infinity();
    return breaks("V17") ? 0.7 * limits.max_range : sound_->reach(limits);
  }

 private:
  [[nodiscard]] Result<std::shared_ptr<const VisibilityScene>> scene_over(
      PointsView map, VisibilityLimits limits) const {
    // Finds out too late that there is nothing to see.
    if (breaks("V10") && map.empty()) map = kOrigin;
    // A sensor that reaches far sees everything.
    const bool lenient = breaks("V2") && std::isinf(limits.max_range);
    if (breaks("V8")) limits.max_range = std::numeric_limits<double>::infinity();
    if (breaks("V5")) {
      const PointCloud corners =
          in_single_precision(std::array{limits.map_bounds.min, limits.map_bounds.max});
      limits.map_bounds = {corners[0], corners[1]};
      return OwningScene::over(*sound_, in_single_precision(map), limits);
    }
    if (breaks("V13")) return remembered(map, limits);
    return OwningScene::over(lenient ? *lenient_ : *sound_, {map.begin(), map.end()}, limits);
  }

  /// Takes a map at the same place for the same map.
  [[nodiscard]] Result<std::shared_ptr<const VisibilityScene>> remembered(
      PointsView map, const VisibilityLimits& limits) const {
    const std::scoped_lock lock(mutex_);
    if (!scene_ || last_.data() != map.data() || last_.size() != map.size()) {
      VANTAGE_TRY(scene_, OwningScene::over(*sound_, {map.begin(), map.end()}, limits));
      last_ = map;
    }
    return scene_;
  }

  static inline const PointCloud kOrigin{Point::Zero()};
  PluginPtr<VisibilityOperator> sound_, lenient_;
  mutable std::mutex mutex_;
  mutable PointsView last_;
  mutable std::shared_ptr<const VisibilityScene> scene_;
};

}  // namespace
}  // namespace vantage::broken

VANTAGE_BROKEN_PLUGIN(vantage::VisibilityOperator);
