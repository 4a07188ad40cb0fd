#include "view/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "vantage/io/point_cloud_io.hpp"

namespace vantage::view {
namespace {

Point whole_metres(const Bounds3& bounds) {
  return bounds.empty() ? Point::Zero()
                        : Point((0.5 * (bounds.min + bounds.max)).array().round() + 0.0);  // no -0
}

Result<void> check_points_are_there(const MapIndex& index, const std::filesystem::path& folder) {
  std::uint64_t points = 0, elements = 0;
  for (const RegionSummary& region : index.regions) {
    points += region.points;
    elements += region.elements;
  }
  if (points > 0) return {};
  const SourceLocation where{folder.string(), 0, 0};
  if (elements == 0)
    return fail(ErrorCode::unsupported, "the maps of all regions are empty", where);
  return fail(ErrorCode::unsupported,
              fmt::format("the bundle holds prepared maps only ({} elements of a matcher for {} "
                          "regions) and no points to show; store.content = \"both\" keeps them",
                          elements, index.regions.size()),
              where);
}

std::optional<std::uint32_t> number_in(const std::string& text) {
  std::uint32_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return number;
}

}  // namespace

Result<Scene> Scene::open_bundle(const std::filesystem::path& folder, const PluginLoader& loader,
                                 std::size_t max_points) {
  PluginChoice choice{.plugin = "pcd_tiles", .library = {}, .params = {}, .where = {}};
  choice.params.entries.push_back({"root", {folder.string(), {}}, {}});
  Scene scene;
  scene.name_ = folder.string();
  scene.max_points_ = max_points;
  VANTAGE_TRY(scene.store_, loader.load<MapStore>(choice));
  VANTAGE_TRY(scene.index_, scene.store_->index());
  VANTAGE_CHECK(check_points_are_there(*scene.index_, folder));
  scene.total_ = scene.index_->map_points;
  scene.origin_ = whole_metres(scene.index_->map_bounds);
  scene.hues_ = region_hues(scene.index_->partition.regions());
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

bool Scene::has_views() const noexcept {
  return index_ && std::any_of(index_->regions.begin(), index_->regions.end(),
                               [](const RegionSummary& region) { return region.max_views > 0; });
}

Result<RegionId> Scene::find_region(const std::string& id) const {
  const auto& regions = index_->partition.regions();
  std::vector<std::string> labels;
  for (std::uint32_t r = 0; r < regions.size(); ++r) {
    if (regions[r].label == id) return RegionId{r};
    labels.push_back(regions[r].label);
  }
  if (const auto number = number_in(id); number && *number < regions.size()) {
    return RegionId{*number};
  }
  return fail(ErrorCode::not_found,
              fmt::format("no region '{}'{}; there are {} regions, 0 ('{}') to {} ('{}')", id,
                          did_you_mean(id, labels), regions.size(), labels.front(),
                          regions.size() - 1, labels.back()),
              SourceLocation{name_, 0, 0});
}

Result<void> Scene::read_all(const ReadProgress& progress) {
  if (table_) return {};
  PointTable table(index_->map_bounds, max_points_);
  const std::size_t count = index_->regions.size();
  for (std::uint32_t r = 0; r < count; ++r) {
    if (index_->regions[r].points > 0) {
      VANTAGE_TRY(const RegionMap map, store_->get(RegionId{r}));
      table.add(map.points, map.views);
    }
    if (progress) progress(r + 1, count);
  }
  table_ = std::move(table);
  return {};
}

Drawing Scene::around_origin(PointsView points) const {
  Drawing drawing;
  drawing.points.reserve(points.size());
  for (const Point& p : points) drawing.points.push_back(p - origin_);
  if (!index_) return drawing;
  drawing.regions.reserve(points.size());
  for (const Point& p : points) {
    auto owner = index_->partition.locate(p);
    if (!owner) owner = index_->partition.nearest(p.head<2>());
    drawing.regions.push_back(owner ? owner->value : 0);
  }
  return drawing;
}

Result<Drawing> Scene::draw_region(RegionId region, bool count_views,
                                   const ReadProgress& progress) {
  const std::string& label = index_->partition[region].label;
  if (index_->regions[region.value].points == 0) {
    return fail(ErrorCode::unsupported, "the map of region '" + label + "' holds no points",
                SourceLocation{name_, 0, 0});
  }
  const bool count_maps = count_views && !has_views();
  if (count_maps) VANTAGE_CHECK(read_all(progress));
  VANTAGE_TRY(RegionMap map, store_->get(region));
  if (count_maps) std::erase_if(map.points, [&](const Point& p) { return !table_->views_at(p); });
  PointTable own(index_->map_bounds, max_points_);
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

Result<Drawing> Scene::draw(const std::optional<RegionId>& region, bool count_views,
                            const ReadProgress& progress) {
  if (region) return draw_region(*region, count_views, progress);
  VANTAGE_CHECK(read_all(progress));
  Drawing drawing = around_origin(table_->points());
  drawing.thinned = table_->thinned();
  if (index_) drawing.views = table_->views();
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
  return scales;
}

std::vector<Color> colors_of(const Drawing& drawing, Coloring coloring, const Scales& scales,
                             const std::vector<double>& hues) {
  // The darkest end of the maps is left out: it would not stand out from the background.
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
    }
  }
  return colors;
}

}  // namespace vantage::view
