#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <tuple>
#include <vector>

#include "depth_image.hpp"
#include "vantage/kit/index_set.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/point_grid.hpp"
#include "vantage/kit/scene_by_viewpoint.hpp"
#include "vantage/kit/visibility_checks.hpp"

namespace {

using vantage::ErrorCode, vantage::fail, vantage::IndexList, vantage::IndexSet, vantage::Point,
    vantage::PointsView, vantage::Result, vantage::SceneByViewpoint, vantage::VisibilityLimits,
    vantage::VisibilityProgress, vantage::VisibilityScene;
using vantage::range_image::DepthImage, vantage::range_image::Occlusion,
    vantage::range_image::Sensor, vantage::range_image::Spot;

constexpr double kCellWidth = 2.0;     // [m], at least
constexpr double kCellsAcross = 16.0;  // in a range, at most

/// What one viewpoint after another needs, so that a thread asks for memory once.
struct Workspace {
  struct Candidate {
    std::uint32_t index, pixel;
    float range;
  };
  DepthImage image;
  std::vector<Candidate> candidates = {};  // what nothing but other points can hide
  IndexList seen = {};
};

class Scene final : public SceneByViewpoint {
 public:
  Scene(PointsView map, const Sensor& sensor, const Occlusion& occlusion)
      : SceneByViewpoint(map.size()),
        map_(map),
        sensor_(sensor),
        occlusion_(occlusion),
        cells_(map, std::max(kCellWidth, sensor.max_range / kCellsAcross)) {}

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return vantage::guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(vantage::check_viewpoints({&viewpoint, 1}));
      Workspace workspace = make_workspace();
      IndexSet seen(map_.size());
      look_from(viewpoint, workspace, seen);
      return seen.ascending();
    });
  }

  [[nodiscard]] Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress) const noexcept override {
    return vantage::guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(vantage::check_viewpoints(viewpoints));
      IndexSet seen(map_.size());
      tbb::enumerable_thread_specific<Workspace> workspaces([this] { return make_workspace(); });
      tbb::parallel_for(std::size_t{0}, viewpoints.size(), [&](std::size_t k) {
        look_from(viewpoints[k], workspaces.local(), seen);
        if (progress != nullptr) progress->advanced(1);
      });
      return seen.ascending();
    });
  }

 private:
  [[nodiscard]] Workspace make_workspace() const { return {.image = {sensor_, occlusion_}}; }

  void look_from(const Point& viewpoint, Workspace& workspace, IndexSet& seen) const {
    // Not a structured binding: clang 14 cannot capture one.
    auto& image = workspace.image;
    auto& candidates = workspace.candidates;
    auto& seen_here = workspace.seen;
    image.clear();
    candidates.clear();
    seen_here.clear();
    cells_.for_each_near(viewpoint, sensor_.max_range, [&](std::uint32_t i) {
      const auto spot = image.locate(map_[i] - viewpoint);
      if (!spot) return;
      image.draw(*spot);
      if (!seen.contains(i)) candidates.push_back({i, image.pixel(*spot), spot->range});
    });
    image.finish();
    for (const auto& candidate : candidates) {
      if (image.sees(candidate.pixel, candidate.range)) seen_here.push_back(candidate.index);
    }
    seen.add(seen_here);
  }

  PointsView map_;
  Sensor sensor_;
  Occlusion occlusion_;
  vantage::PointGrid cells_;
};

constexpr double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

/// A spinning LiDAR's range image of the map, with points as large as their spacing.
struct Params {
  std::uint32_t rings = 64;
  double lowest_elevation = -24.9;  // [deg]
  double highest_elevation = 2.0;   // [deg]
  double azimuth_resolution = 0.2;  // [deg]
  double min_range = 0.5;           // [m]
  double point_spacing = 0.1;       // [m]
  double tolerance = 0.3;           // [m]
  double relative_tolerance = 0.0;

  static constexpr auto schema() {
    using vantage::between, vantage::non_negative, vantage::optional, vantage::Source;
    return std::tuple{
        optional("rings", &Params::rings, "",
                 "rows of the image, spread evenly from lowest_elevation to highest_elevation",
                 between(1, 2048)),
        optional("lowest_elevation", &Params::lowest_elevation, "deg",
                 "lower end of the field of view; points below it are not seen and do not occlude",
                 between(-90.0, 90.0)),
        optional("highest_elevation", &Params::highest_elevation, "deg",
                 "upper end of the field of view; points above it are not seen and do not occlude",
                 between(-90.0, 90.0)),
        optional("azimuth_resolution", &Params::azimuth_resolution, "deg",
                 "width of a pixel, rounded so that it divides the full turn", between(0.02, 90.0)),
        optional("min_range", &Params::min_range, "m",
                 "points nearer than this are not seen and do not occlude", non_negative),
        optional("point_spacing", &Params::point_spacing, "m",
                 "distance between neighbouring map points on a surface: each covers a square of "
                 "this width, so that no point is seen through the gaps; if left out, `vantage "
                 "build` measures it in the map",
                 between(0.0, 10.0)),
        optional("tolerance", &Params::tolerance, "m",
                 "how far behind the nearest point of its pixel a point is still seen",
                 between(0.0, 1000.0), Source{"", "Biasutti et al. 2019"}),
        optional("relative_tolerance", &Params::relative_tolerance, "",
                 "added to tolerance: this times the distance of that nearest point",
                 between(0.0, 10.0))};
  }

  [[nodiscard]] Result<void> validate() const {
    if (highest_elevation - lowest_elevation < 0.1) {
      return vantage::fail_at(
          {"highest_elevation", "lowest_elevation"},
          "'highest_elevation' must be at least 0.1 deg above 'lowest_elevation'");
    }
    return {};
  }

  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const {
    VANTAGE_CHECK(check_map(map, limits));
    const Sensor sensor{
        .rings = rings,
        .columns = static_cast<std::uint32_t>(std::round(360.0 / azimuth_resolution)),
        .lowest = radians(lowest_elevation),
        .highest = radians(highest_elevation),
        .min_range = min_range,
        .max_range = limits.max_range};
    const Occlusion occlusion{.point_spacing = point_spacing,
                              .tolerance = tolerance,
                              .relative_tolerance = relative_tolerance};
    return std::make_unique<Scene>(map, sensor, occlusion);
  }

  [[nodiscard]] static double reach(const VisibilityLimits& limits) { return limits.max_range; }

  [[nodiscard]] Result<void> check_map(PointsView map, const VisibilityLimits& limits) const {
    VANTAGE_CHECK(vantage::check_map_in_bounds(map, limits));
    if (limits.max_range >= min_range) return {};
    return fail(ErrorCode::invalid_input, "max_range must be > 0 m and not below min_range");
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::VisibilityOperator, vantage::VisibilityOperatorOf<Params>, "range_image",
               "what a spinning LiDAR would see: the nearest points of each pixel of its image");
