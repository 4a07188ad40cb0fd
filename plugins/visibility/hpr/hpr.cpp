#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>

#include "hidden_point_removal.hpp"
#include "vantage/plugin.hpp"

namespace {

using vantage::Bounds3, vantage::ErrorCode, vantage::fail, vantage::IndexList, vantage::Point,
    vantage::PointsView, vantage::Result, vantage::VisibilityLimits, vantage::VisibilityOperator,
    vantage::VisibilityProgress, vantage::VisibilityScene;
using vantage::hpr::Kernel;

constexpr double kDefaultAlpha = 100.0;  // Sec. 3.2.2
constexpr double kMaxRadius = 1e12;      // [m]; with a larger R, 2R - |p| is rounded to more than
                                         // 0.1 mm

class Scene final : public VisibilityScene {
 public:
  Scene(PointsView map, const vantage::hpr::Settings& settings)
      : VisibilityScene(map.size()), hpr_(map, settings) {}

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return vantage::guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(check({&viewpoint, 1}));
      return hpr_.visible(viewpoint);
    });
  }

  [[nodiscard]] Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress) const noexcept override {
    return vantage::guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(check(viewpoints));
      return hpr_.visible_from_any(viewpoints, progress);
    });
  }

 private:
  [[nodiscard]] static Result<void> check(std::span<const Point> viewpoints) {
    for (const Point& viewpoint : viewpoints) {
      if (!viewpoint.allFinite()) {
        return fail(ErrorCode::invalid_input, "the viewpoint has a coordinate that is not finite");
      }
    }
    return {};
  }

  vantage::hpr::HiddenPointRemoval hpr_;
};

/// Hidden point removal (Katz, Tal, Basri 2007; Eqs. 6-9).
class HiddenPointRemoval final : public VisibilityOperator {
 public:
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
                   "R = alpha * diagonal of the map, no effect on inversion; 100 if left out, or "
                   "what gap makes of R",
                   vantage::between(1.0, 1e6), Source{"Eq. 6", "Yagi et al. 2026, Sec. 2.3"}),
          optional("gap", &Params::gap, "m",
                   "instead of alpha: a point this far behind a surface is hidden", positive),
          optional("angular_spacing", &Params::angular_spacing, "deg",
                   "goes with gap, left out without it: angle between neighbouring samples of that "
                   "surface",
                   vantage::strictly_between(0.0, 90.0))};
    }

    [[nodiscard]] Result<void> validate() const {
      if (alpha && (gap || angular_spacing)) {
        return vantage::fail_at({"alpha"},
                                "'alpha' and 'gap' both set the radius R; give only one of them");
      }
      if (gap.has_value() != angular_spacing.has_value()) {
        return vantage::fail_at({"gap", "angular_spacing"},
                                gap ? "'gap' needs 'angular_spacing' beside it"
                                    : "'angular_spacing' needs 'gap' beside it");
      }
      return {};
    }
  };

  explicit HiddenPointRemoval(const Params& params) noexcept : params_(params) {}

  [[nodiscard]] static Result<std::unique_ptr<VisibilityOperator>> create(const Params& params) {
    return std::make_unique<HiddenPointRemoval>(params);
  }

  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept override {
    return vantage::guarded([&]() -> Result<std::unique_ptr<VisibilityScene>> {
      VANTAGE_CHECK(check_map(map, limits));
      const double diagonal = limits.map_bounds.diagonal();
      const double radius = radius_for(diagonal);
      // No point of the map is farther than the diagonal from a viewpoint within the map's bounds.
      const double reach = std::min(diagonal, limits.max_range);
      if (params_.kernel == Kernel::spherical_flip && !(radius >= reach && radius <= kMaxRadius)) {
        return fail(
            ErrorCode::invalid_input,
            "the radius R is " + std::to_string(radius) + " m; it must be at least " +
                std::to_string(reach) +
                " m, the reach of the sensor or the diagonal of the map, and at most 1e12 m");
      }
      return std::make_unique<Scene>(
          map, vantage::hpr::Settings{
                   .kernel = params_.kernel, .radius = radius, .max_range = limits.max_range});
    });
  }

 private:
  [[nodiscard]] static Result<void> check_map(PointsView map, const VisibilityLimits& limits) {
    VANTAGE_CHECK(vantage::check_points(map, "the map"));
    if (!(limits.max_range > 0.0)) {
      return fail(ErrorCode::invalid_input, "max_range must be > 0 m");
    }
    const Bounds3& bounds = limits.map_bounds;
    const Bounds3 needed = vantage::bounds_of(map);
    if (!((bounds.min.array() <= needed.min.array()).all() &&
          (bounds.max.array() >= needed.max.array()).all())) {
      return fail(ErrorCode::invalid_input, "map_bounds does not enclose every point of the map");
    }
    return {};
  }

  [[nodiscard]] double radius_for(double diagonal) const {
    if (!params_.gap) return params_.alpha.value_or(kDefaultAlpha) * diagonal;  // Eq. 6
    const double delta = 0.5 * *params_.angular_spacing * std::numbers::pi / 180.0;
    return *params_.gap / (delta * delta);
  }

  Params params_;
};

}  // namespace

VANTAGE_PLUGIN(vantage::VisibilityOperator, HiddenPointRemoval, "hpr",
               "exact hidden point removal (Katz, Tal, Basri 2007; Eqs. 6-9)");
