// Throws from a method that the kit calls from many threads at once: with OUT_OF_MEMORY into
// `guarded`, which no exception leaves, and otherwise out of it.
#include <new>
#include <stdexcept>

#include "vantage/kit/scene_by_viewpoint.hpp"
#include "vantage/plugin.hpp"

namespace {

class Scene final : public vantage::SceneByViewpoint {
 public:
  explicit Scene(std::size_t map_size) : SceneByViewpoint(map_size) {}
  [[nodiscard]] vantage::Result<vantage::IndexList> visible(
      const vantage::Point&) const noexcept override {
#ifdef OUT_OF_MEMORY
    return vantage::guarded(
        []() -> vantage::Result<vantage::IndexList> { throw std::bad_alloc(); });
#else
    throw std::runtime_error("the scene went dark");
#endif
  }
};

class Throws final : public vantage::VisibilityOperator {
 public:
  using Params = vantage::NoParams;
  static vantage::Result<std::unique_ptr<vantage::VisibilityOperator>> create(const Params&) {
    return std::make_unique<Throws>();
  }
  [[nodiscard]] vantage::Result<std::unique_ptr<vantage::VisibilityScene>> prepare(
      vantage::PointsView map, const vantage::VisibilityLimits&) const noexcept override {
    return std::make_unique<Scene>(map.size());
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::VisibilityOperator, Throws, PLUGIN_NAME, "throws from a noexcept method");
