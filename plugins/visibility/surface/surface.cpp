#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "elements.hpp"
#include "sight.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/visibility_checks.hpp"

namespace vantage::surface {
namespace {

constexpr double kRadian = std::numbers::pi / 180.0;

class Scene final : public VisibilityScene {
 public:
  Scene(PointsView map, Elements elements, const Settings& settings)
      : VisibilityScene(map.size()),
        map_(map),
        elements_(std::move(elements)),
        optics_(elements_.all().size()),
        sights_([this, settings] { return Sight(map_, elements_, optics_, settings); }) {
    for (std::size_t k = 0; k < optics_.size(); ++k) {
      optics_[k] = Optics::of(elements_.all()[k].shape, elements_.width(), settings.thickness);
    }
  }

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return visible_from_any({&viewpoint, 1}, nullptr);
  }

  [[nodiscard]] Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress) const noexcept override {
    return guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(check_viewpoints(viewpoints));
      std::vector<std::atomic<std::uint8_t>> seen(elements_.all().size());
      tbb::enumerable_thread_specific<std::vector<std::uint32_t>> points;
      tbb::parallel_for(std::size_t{0}, viewpoints.size(), [&](std::size_t i) {
        const Sight::Seen here = sights_.local().look(viewpoints[i], [&](std::uint32_t element) {
          return seen[element].load(std::memory_order_relaxed) != 0;
        });
        for (const std::uint32_t k : here.elements) seen[k].store(1, std::memory_order_relaxed);
        points.local().insert(points.local().end(), here.points.begin(), here.points.end());
        if (progress != nullptr) progress->advanced(1);
      });
      IndexList all;
      for (const auto& of_thread : points)
        all.insert(all.end(), of_thread.begin(), of_thread.end());
      for (std::size_t k = 0; k < seen.size(); ++k) {
        if (seen[k] == 0) continue;
        const auto of_element = elements_.points(elements_.all()[k]);
        all.insert(all.end(), of_element.begin(), of_element.end());
      }
      std::sort(all.begin(), all.end());
      all.erase(std::unique(all.begin(), all.end()), all.end());
      return all;
    });
  }

 private:
  PointsView map_;
  Elements elements_;
  std::vector<Optics> optics_;
  mutable tbb::enumerable_thread_specific<Sight> sights_;
};

/// Surface elements that appear bright enough through what stands before them.
struct Params {
  double faintest = -35.0;
  double point_spacing = 0.12;
  double thickness = 0.075;

  static constexpr auto schema() {
    return std::tuple{
        optional("faintest", &Params::faintest, "dB",
                 "a surface element is seen if 0.09 m^2 of it, less what is hidden, appear at "
                 "least this much larger than 1 square degree; lower values see more",
                 between(-200.0, 30.0)),
        optional("point_spacing", &Params::point_spacing, "m",
                 "distance between neighbouring points on the map's surfaces; an element is 2.5 "
                 "times as wide",
                 between(0.01, 10.0)),
        optional("thickness", &Params::thickness, "m",
                 "thickness of the map's surfaces, including noise; thicker elements are clutter "
                 "and count less",
                 between(1e-3, 10.0)),
    };
  }

  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const {
    VANTAGE_CHECK(check_map_in_bounds(map, limits));
    // Anchored at the map: where its frame has its origin does not matter.
    VANTAGE_TRY(auto elements, Elements::of(map, limits.map_bounds.min, point_spacing));
    return std::make_unique<Scene>(
        map, std::move(elements),
        Settings{.min_size = std::pow(10.0, 0.1 * faintest) * kRadian * kRadian,
                 .thickness = thickness,
                 .max_range = limits.max_range});
  }

  [[nodiscard]] double reach(const VisibilityLimits& limits) const {
    return limits.max_range + Elements::reach_around(point_spacing);
  }
};

}  // namespace
}  // namespace vantage::surface

VANTAGE_PLUGIN(vantage::VisibilityOperator, vantage::VisibilityOperatorOf<vantage::surface::Params>,
               "surface",
               "surface elements that appear bright enough through the objects in front of them");
