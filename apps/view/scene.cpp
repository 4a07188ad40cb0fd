#include "view/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nanoflann.hpp>

#include "localizability/localizability.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/kd_tree_points.hpp"
#include "vantage/kit/regions.hpp"

namespace vantage::view {
namespace {

/// A smaller leverage is drawn as this one.
constexpr double kLeastLeverage = 1e-9;

Point whole_metres(const Bounds3& bounds) {
  return bounds.empty() ? Point::Zero()
                        : Point((0.5 * (bounds.min + bounds.max)).array().round() + 0.0);  // no -0
}

/// The expected error at the site nearest to each point.
std::vector<double> errors_at(PointsView points, const Atlas& atlas) {
  PointCloud places;
  for (const Site& site : atlas.sites) places.push_back(site.position);
  const KdTreePoints<Point> sites{places};
  using Distance = nanoflann::L2_Simple_Adaptor<double, KdTreePoints<Point>>;
  const nanoflann::KDTreeSingleIndexAdaptor<Distance, KdTreePoints<Point>, 3, std::uint32_t> tree(
      3, sites);
  std::vector<double> errors;
  errors.reserve(points.size());
  for (const Point& p : points) {
    std::uint32_t nearest = 0;
    double squared = 0.0;
    tree.knnSearch(p.data(), 1, &nearest, &squared);
    errors.push_back(expected_error(atlas.sites[nearest]));
  }
  return errors;
}

}  // namespace

Result<Scene> Scene::open_bundle(const std::filesystem::path& folder, const PluginLoader& plugins,
                                 std::size_t max_points) {
  VANTAGE_TRY(const Bundle bundle, Bundle::open(folder, plugins));
  Scene scene;
  scene.name_ = bundle.name();
  scene.max_points_ = max_points;
  VANTAGE_TRY(scene.index_, bundle.index());
  scene.total_ = scene.index_->map_points;
  scene.origin_ = whole_metres(scene.index_->map_bounds);
  scene.hues_ = region_hues(scene.index_->partition.regions());
  scene.bundle_ = bundle;
  // A bundle whose atlas cannot be read still has points to show.
  auto atlas = Atlas::of_bundle(bundle);
  if (!atlas) {
    scene.no_atlas_ = std::move(atlas).error();
  } else if (!*atlas || (*atlas)->sites.empty()) {
    scene.no_atlas_ = Error{.code = ErrorCode::not_found,
                            .message = std::string("the bundle has no atlas: ") + kHowToGetAnAtlas,
                            .where = SourceLocation{scene.name_, 0, 0},
                            .context = {}};
  } else {
    scene.atlas_ = *std::move(atlas);
  }
  return scene;
}

Result<Scene> Scene::open_cloud(const std::filesystem::path& file, std::size_t max_points) {
  VANTAGE_TRY(const auto cloud, io::read_point_cloud(file));
  if (cloud.points.empty()) {
    return fail(ErrorCode::invalid_input,
                fmt::format("the cloud holds no finite point ({} dropped)", cloud.dropped),
                SourceLocation{file.string(), 0, 0});
  }
  Scene scene;
  scene.name_ = file.string();
  scene.max_points_ = max_points;
  scene.total_ = cloud.points.size();
  scene.dropped_ = cloud.dropped;
  const Bounds3 bounds = bounds_of(cloud.points);
  scene.origin_ = whole_metres(bounds);
  scene.table_.emplace(bounds, max_points);
  scene.table_->add(cloud.points);
  return scene;
}

Result<void> Scene::need_atlas() const {
  return no_atlas_ ? Result<void>(fail(*no_atlas_)) : Result<void>();
}

Result<void> Scene::need_points() const {
  if (!bundle_) return {};
  auto points = bundle_->need_points("show");
  const bool elements = bundle_->directory()->summary().sum.elements > 0;
  if (points || !elements) return points;
  Error error = std::move(points).error();
  error.message +=
      "; --color contribution with --scans and --reference shows which elements fix the poses of "
      "scans";
  return fail(std::move(error));
}

Result<void> Scene::read_all(const Bundle::Progress& progress) {
  if (table_) return {};
  PointTable table(index_->map_bounds, max_points_);
  VANTAGE_CHECK(bundle_->for_each_region(
      [&](RegionId, const RegionMap& map) -> Result<void> {
        table.add(map.points, map.views);
        return {};
      },
      progress));
  table_ = std::move(table);
  return {};
}

Drawing Scene::around_origin(PointsView points) const {
  Drawing drawing;
  drawing.points.reserve(points.size());
  for (const Point& p : points) drawing.points.push_back(p - origin_);
  if (!bundle_) return drawing;
  const Partition& partition = index_->partition;
  drawing.regions.reserve(points.size());
  for (const Point& p : points) {
    auto owner = partition.locate(p);
    if (!owner) owner = nearest_region(partition, p.head<2>());
    drawing.regions.push_back(owner ? owner->value : 0);
  }
  if (atlas_) drawing.expected_errors = errors_at(points, *atlas_);
  return drawing;
}

Result<Drawing> Scene::draw_region(RegionId region, bool count_views,
                                   const Bundle::Progress& progress) {
  const MapIndex& index = *index_;
  if (index.regions[region.value].points == 0) {
    return fail(ErrorCode::unsupported,
                "the map of region '" + index.partition[region].label + "' holds no points",
                SourceLocation{name_, 0, 0});
  }
  const bool count_maps = count_views && !bundle_->has_views();
  if (count_maps) VANTAGE_CHECK(read_all(progress));
  VANTAGE_TRY(RegionMap map, bundle_->get(region));
  if (count_maps) std::erase_if(map.points, [&](const Point& p) { return !table_->views_at(p); });
  PointTable own(index.map_bounds, max_points_);
  own.add(map.points, map.views);
  Drawing drawing = around_origin(own.points());
  drawing.thinned = count_maps ? table_->thinned() : own.thinned();
  if (count_maps) {
    for (const Point& p : own.points()) drawing.views.push_back(table_->views_at(p));
  } else if (count_views) {
    drawing.views = own.views();
  }
  for (const Point& p : map.viewpoints) drawing.viewpoints.push_back(p - origin_);
  return drawing;
}

Result<Drawing> Scene::draw_elements(const std::optional<RegionId>& region) const {
  std::vector<Contribution> elements = contributions_->elements(region);
  if (elements.empty()) {
    return fail(ErrorCode::not_found,
                region ? "no scan counts in region '" + index_->partition[*region].label + "'"
                       : "no scan has a point in an element of the map",
                SourceLocation{name_, 0, 0});
  }
  const bool thinned = elements.size() > max_points_;
  if (thinned) {
    const auto end = elements.begin() + static_cast<std::ptrdiff_t>(max_points_);
    std::ranges::nth_element(elements, end, std::greater(), &Contribution::leverage);
    elements.erase(end, elements.end());
  }
  PointCloud middles;
  for (const Contribution& element : elements) middles.push_back(element.middle);
  Drawing drawing = around_origin(middles);
  drawing.thinned = thinned;
  for (const Contribution& element : elements) drawing.leverages.push_back(element.leverage);
  if (!region) return drawing;
  VANTAGE_TRY(const RegionMap map, bundle_->get(*region));
  for (const Point& p : map.viewpoints) drawing.viewpoints.push_back(p - origin_);
  return drawing;
}

Result<Drawing> Scene::draw(const std::optional<RegionId>& region, bool count_views,
                            const Bundle::Progress& progress) {
  if (contributions_) return draw_elements(region);
  if (region) return draw_region(*region, count_views, progress);
  VANTAGE_CHECK(read_all(progress));
  Drawing drawing = around_origin(table_->points());
  drawing.thinned = table_->thinned();
  if (bundle_) drawing.views = table_->views();
  return drawing;
}

Scales scales_of(const Drawing& drawing) {
  std::vector<double> heights;
  for (const Point& p : drawing.points) heights.push_back(p.z());
  Scales scales;
  scales.height = range_of(std::move(heights));
  if (!drawing.views.empty()) {
    scales.views = range_of(std::vector<double>(drawing.views.begin(), drawing.views.end()));
    scales.views.low = 1.0;
    scales.views.high = std::max(scales.views.high, 2.0);
  }
  if (!drawing.leverages.empty()) {
    const double high = std::max(range_of(drawing.leverages).high, kLeastLeverage);
    scales.contribution.high = std::log10(high);
    scales.contribution.low = scales.contribution.high - 2.0;
  }
  return scales;
}

double share_of_error(double expected_error) noexcept {
  const double ends = std::log(kLargestError / kLeastError);
  return std::clamp(std::log(expected_error / kLeastError) / ends, 0.0, 1.0);
}

std::vector<Color> colors_of(const Drawing& drawing, Coloring coloring, const Scales& scales,
                             const std::vector<double>& hues) {
  // The darkest end of the maps is left out, because it would not stand out from the background.
  const auto visible = [](double share) { return 0.14 + 0.86 * share; };
  std::vector<Color> colors;
  colors.reserve(drawing.points.size());
  for (std::size_t i = 0; i < drawing.points.size(); ++i) {
    const double height = scales.height.share(drawing.points[i].z());
    switch (coloring) {
      case Coloring::height: colors.push_back(viridis(visible(height))); break;
      case Coloring::region:
        colors.push_back(hue_color(hues[drawing.regions[i]], 0.55 + 0.3 * std::sqrt(height)));
        break;
      case Coloring::views:
        colors.push_back(magma(visible(scales.views.share(drawing.views[i]))));
        break;
      case Coloring::contribution: {
        const double leverage = std::max(drawing.leverages[i], kLeastLeverage);
        colors.push_back(magma(visible(scales.contribution.share(std::log10(leverage)))));
        break;
      }
      case Coloring::localizability:
        colors.push_back((0.45 + 0.55 * std::sqrt(height)) *
                         badness(share_of_error(drawing.expected_errors[i])));
        break;
    }
  }
  return colors;
}

}  // namespace vantage::view
