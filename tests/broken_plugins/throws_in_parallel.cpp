// Throws from a method that core calls from many threads at once.
#include <stdexcept>

#include "vantage/plugin.hpp"

namespace {

class Scene final : public vantage::VisibilityScene {
 public:
  explicit Scene(std::size_t map_size) : VisibilityScene(map_size) {}
  [[nodiscard]] vantage::Result<vantage::IndexList> visible(
      const vantage::Point&) const noexcept override {
    throw std::runtime_error("the scene went dark");
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

VANTAGE_PLUGIN(vantage::VisibilityOperator, Throws, "throws", "throws from a noexcept method");
