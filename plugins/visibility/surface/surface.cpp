#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <numeric>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "blocks.hpp"
#include "elements.hpp"
#include "sight.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/scene_by_viewpoint.hpp"
#include "vantage/kit/visibility_checks.hpp"

namespace vantage::surface {
namespace {

constexpr double kRadian = std::numbers::pi / 180.0;

/// Each index once, in ascending order. A radix sort: regions have millions of points.
IndexList sorted(IndexList indices) {
  constexpr std::uint32_t kBits = 11, kMask = (1U << kBits) - 1;
  IndexList other(indices.size());
  for (std::uint32_t shift = 0; shift < 32; shift += kBits) {
    std::array<std::size_t, kMask + 2> begin{};
    for (const std::uint32_t k : indices) ++begin[((k >> shift) & kMask) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    for (const std::uint32_t k : indices) other[begin[(k >> shift) & kMask]++] = k;
    indices.swap(other);
  }
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  return indices;
}

class Scene final : public SceneByViewpoint {
 public:
  Scene(PointsView map, Elements elements, const Settings& settings)
      : SceneByViewpoint(map.size()),
        elements_(std::move(elements)),
        blocks_(elements_, settings.thickness),
        reach_(settings.reach() + elements_.width() * std::numbers::sqrt3),
        sights_([this, map, settings] { return Sight(map, elements_, blocks_, settings); }) {}

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return visible_from_any({&viewpoint, 1}, nullptr);
  }

  [[nodiscard]] Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress) const noexcept override {
    return guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(check_viewpoints(viewpoints));
      if (viewpoints.empty()) return IndexList{};
      Known known(blocks_, viewpoints, reach_);
      tbb::enumerable_thread_specific<std::vector<std::uint32_t>> points;
      tbb::parallel_for(std::size_t{0}, viewpoints.size(), [&](std::size_t i) {
        const auto here = sights_.local().look(viewpoints[i], known);
        points.local().insert(points.local().end(), here.begin(), here.end());
        if (progress != nullptr) progress->advanced(1);
      });
      IndexList all;
      for (const auto& of_thread : points)
        all.insert(all.end(), of_thread.begin(), of_thread.end());
      for (const std::uint32_t k : known.elements()) {
        const auto of_element = elements_.points(elements_.all()[blocks_.number(k)]);
        all.insert(all.end(), of_element.begin(), of_element.end());
      }
      return sorted(std::move(all));
    });
  }

 private:
  Elements elements_;
  Blocks blocks_;
  double reach_;  // of a sight [m]
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
                 "times as wide; if left out, `vantage build` measures it in the map",
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
