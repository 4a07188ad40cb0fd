#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>

#include "hidden_point_removal.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/scene_by_viewpoint.hpp"
#include "vantage/kit/visibility_checks.hpp"

namespace {

using vantage::IndexList, vantage::Point, vantage::PointsView, vantage::Result,
    vantage::SceneByViewpoint, vantage::VisibilityLimits, vantage::VisibilityProgress,
    vantage::VisibilityScene;
using vantage::hpr::Kernel;

constexpr double kDefaultAlpha = 100.0;  // Sec. 3.2.2

class Scene final : public SceneByViewpoint {
 public:
  Scene(PointsView map, const vantage::hpr::Settings& settings)
      : SceneByViewpoint(map.size()), hpr_(map, settings) {}

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return vantage::guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(vantage::check_viewpoints({&viewpoint, 1}));
      return hpr_.visible(viewpoint);
    });
  }

  [[nodiscard]] Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress) const noexcept override {
    return vantage::guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(vantage::check_viewpoints(viewpoints));
      return hpr_.visible_from_any(viewpoints, progress);
    });
  }

 private:
  vantage::hpr::HiddenPointRemoval hpr_;
};

/// Hidden point removal (Katz, Tal, Basri 2007; Eqs. 6-9).
struct Params {
  Kernel kernel = Kernel::spherical_flip;
  std::optional<double> alpha;            // of Eq. 6
  std::optional<double> gap;              // [m]
  std::optional<double> angular_spacing;  // [deg]

  static constexpr auto schema() {
    using vantage::optional, vantage::positive, vantage::Source;
    return std::tuple{
        optional("kernel", &Params::kernel, "",
                 "how points are turned: the flip of Katz et al., or Eq. 8 as printed",
                 Source{"Eq. 8", "Katz et al. 2007; Yagi et al. 2026, Sec. 2.3"}),
        optional("alpha", &Params::alpha, "",
                 "R = alpha * diagonal of the map; no effect on inversion; if left out, 100, or R "
                 "follows from gap",
                 vantage::between(1.0, 1e6), Source{"Eq. 6", "Yagi et al. 2026, Sec. 2.3"}),
        optional("gap", &Params::gap, "m",
                 "instead of alpha: a point this far behind a surface is hidden", positive),
        optional(
            "angular_spacing", &Params::angular_spacing, "deg",
            "only with gap, otherwise left out: angle between neighbouring samples of that surface",
            vantage::strictly_between(0.0, 90.0))};
  }

  [[nodiscard]] Result<void> validate() const {
    if (alpha && (gap || angular_spacing)) {
      return vantage::fail_at({"alpha"},
                              "'alpha' and 'gap' both set the radius R; give only one of them");
    }
    if (gap.has_value() != angular_spacing.has_value()) {
      return vantage::fail_at(
          {"gap", "angular_spacing"},
          gap ? "'gap' also needs 'angular_spacing'" : "'angular_spacing' also needs 'gap'");
    }
    return {};
  }

  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const {
    VANTAGE_CHECK(vantage::check_map_in_bounds(map, limits));
    const double radius = radius_for(limits.map_bounds.diagonal());
    if (kernel == Kernel::spherical_flip) {
      VANTAGE_CHECK(vantage::check_flip_radius(radius, limits));
    }
    return std::make_unique<Scene>(
        map,
        vantage::hpr::Settings{.kernel = kernel, .radius = radius, .max_range = limits.max_range});
  }

  [[nodiscard]] static double reach(const VisibilityLimits& limits) { return limits.max_range; }

  [[nodiscard]] double radius_for(double diagonal) const {
    if (!gap) return alpha.value_or(kDefaultAlpha) * diagonal;  // Eq. 6
    const double delta = 0.5 * *angular_spacing * std::numbers::pi / 180.0;
    return *gap / (delta * delta);
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::VisibilityOperator, vantage::VisibilityOperatorOf<Params>, "hpr",
               "exact hidden point removal (Katz, Tal, Basri 2007; Eqs. 6-9)");
