#include "build/plan.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "build/blocks.hpp"
#include "build/places.hpp"
#include "build/plan_index.hpp"
#include "build/selection.hpp"
#include "build/survey.hpp"
#include "vantage/kit/stopwatch.hpp"

namespace vantage {
namespace {

tl::unexpected<Error> needs_whole_map(const std::string& what, const std::string& instead) {
  return fail(ErrorCode::unsupported, what +
                                          " needs the whole map at once, but a tiled map is built "
                                          "part by part: " +
                                          instead);
}

Result<void> check_reaches(const BuildPlugins& plugins, const BuildParams& params,
                           const VisibilityLimits& limits) {
  if (params.viewpoints.source == ViewpointSource::ground && params.viewpoints.reachable) {
    return needs_whole_map("viewpoints.reachable", "leave it out");
  }
  if (plugins.ground && !std::isfinite(plugins.ground->reach())) {
    return needs_whole_map("the plugin of [ground]", "choose another one");
  }
  if (plugins.ground && params.outliers) {
    return needs_whole_map("ground.outliers", "leave it out");
  }
  if (params.scope == VisibilityScope::map && !std::isfinite(plugins.visibility->reach(limits))) {
    return std::isfinite(limits.max_range)
               ? needs_whole_map("the plugin of [visibility]", "choose another one")
               : needs_whole_map("visibility.max_range without a limit", "set max_range");
  }
  if (params.content != StoredContent::points && !std::isfinite(plugins.matcher->reach())) {
    return needs_whole_map("what the plugin of [matcher] prepares", "store points");
  }
  return {};
}

Result<Partition> partition_of(const MapParts& map, PointsView trajectory,
                               const BuildPlugins& plugins, const BuildParams& params,
                               const VisibilityLimits& limits, std::uint64_t memory,
                               const Sight* whole, const std::optional<Places>& places) {
  if (whole != nullptr) {
    return plugins.partitioner->partition(map, trajectory,
                                          BuildSurvey(whole->map(), *places, *whole, params));
  }
  const BlockSurvey survey(map, plugins, params, limits, places, memory);
  auto partition = plugins.partitioner->partition(map, trajectory, survey);
  if (partition || partition.error().code != ErrorCode::unsupported) return partition;
  return needs_whole_map("the plugin of [partitioner]",
                         "choose another one (" + partition.error().message + ")");
}

/// The relocalizer's index of the map; no bytes if there is no relocalizer, or if it cannot index
/// the map.
Result<std::vector<std::byte>> place_index_of(const MapPasses& map, const BuildPlugins& plugins) {
  if (!plugins.relocalizer) return std::vector<std::byte>();
  auto index = plugins.relocalizer->index(map);
  if (!index && index.error().code == ErrorCode::unsupported) return std::vector<std::byte>();
  return index;
}

/// How many points decide about each region: at most, until its viewpoints are known.
class Needs {
 public:
  Needs(const MapParts& map, const BuildPlan& plan, VisibilityScope scope, double reach)
      : map_(map), plan_(plan), scope_(scope), reach_(reach) {
    for (const Region& region : plan.partition.regions()) {
      points_.push_back(map.points_in(with_margin(bounds_of(region.footprint), reach)));
    }
  }

  /// Sorts blocks, those with the region that may need most first.
  void put_first(std::vector<RegionBlock>& blocks) const {
    const auto most = [&](const RegionBlock& block) {
      std::uint64_t points = 0;
      for (const std::uint32_t r : block.regions) points = std::max(points, points_[r]);
      return points;
    };
    std::ranges::stable_sort(blocks, std::greater{}, most);
  }

  /// Counts what regions need, whose viewpoints are known by now.
  /// Errors: that of does_not_fit, for the largest.
  Result<void> check(const std::vector<std::uint32_t>& regions, std::uint64_t memory) {
    RegionNeed largest;
    for (const std::uint32_t r : regions) {
      points_[r] =
          plan_.viewpoints[r].empty() ? 0 : map_.points_in(needed_area(plan_, r, scope_, reach_));
      if (points_[r] > largest.points) largest = {r, points_[r]};
    }
    if (largest.points <= std::min(memory / kBytesASeenPoint, kMostBlockPoints)) return {};
    return does_not_fit(plan_.partition.regions()[largest.region].label, largest.points, memory,
                        kBytesASeenPoint, kBytesASeenPoint * *std::ranges::max_element(points_));
  }

 private:
  const MapParts& map_;
  const BuildPlan& plan_;
  VisibilityScope scope_;
  double reach_;
  std::vector<std::uint64_t> points_;  // by region
};

/// Makes the plan block by block.
class Planner {
 public:
  Planner(const MapParts& map, const BuildPlugins& plugins, const BuildParams& params,
          BuildPlan& plan)
      : map_(map), plugins_(plugins), params_(params), plan_(plan) {}

  /// @param places  none: ground is sought in each block
  Result<void> run(std::uint64_t memory, const std::optional<Places>& places) {
    if (places && !places->own.empty()) VANTAGE_CHECK(place_along(*places));
    const double margin = places ? 0.0 : plugins_.ground->reach();
    std::vector<Bounds2> areas;
    for (const Region& region : plan_.partition.regions()) {
      areas.push_back(with_margin(bounds_of(region.footprint), margin));
    }
    const std::vector<std::uint32_t> all = every_region(areas.size());
    VANTAGE_TRY(auto blocks,
                blocks_of(map_, plan_.partition, all, areas, memory, kBytesAGroundPoint));
    Needs needs(map_, plan_, params_.scope, reach_of(plugins_, params_, plan_.limits));
    if (places) {
      VANTAGE_CHECK(needs.check(all, memory));
    } else {
      needs.put_first(blocks);
    }
    std::uint64_t owned = 0;
    for (const RegionBlock& block : blocks) {
      VANTAGE_TRY(const MapPart part, map_.read(block.area));
      const PointsView points = part.points();
      const std::vector<std::uint32_t> owners = owners_in(block, points, plan_.partition);
      for (const std::uint32_t owner : owners) {
        if (owner == block.regions.size()) continue;
        ++owned;
        ++plan_.owned[block.regions[owner]];
      }
      if (places && places->own.empty()) {
        VANTAGE_CHECK(place_over(points, places->which, block, owners));
      } else if (!places && !points.empty()) {
        VANTAGE_TRY(const IndexList ground, ground_in(points, *plugins_.ground, {}));
        VANTAGE_TRY(const std::uint64_t in_block, place_over(points, ground, block, owners));
        plan_.ground_points += in_block;
      }
      if (!places) VANTAGE_CHECK(needs.check(block.regions, memory));
    }
    if (owned != map_.points()) {
      return fail(ErrorCode::internal,
                  "the partitioner plugin broke its contract: no region owns " +
                      std::to_string(map_.points() - owned) + " of the " +
                      std::to_string(map_.points()) + " map points");
    }
    if (!places && plan_.ground_points == 0) return no_ground();
    return {};
  }

 private:
  /// Makes the viewpoints of a block's regions over its ground (Eqs. 4-5).
  /// @return  how much of the ground the regions own
  Result<std::uint64_t> place_over(PointsView points, const IndexList& ground,
                                   const RegionBlock& block,
                                   const std::vector<std::uint32_t>& owners) {
    const std::size_t regions = block.regions.size();
    const Groups by_region = grouped(
        ground.size(), regions + 1, [&](std::size_t i) { return ground[i]; },
        [&](std::uint32_t k) { return owners[k]; });  // g_ij
    VANTAGE_CHECK(make_viewpoints(points, by_region, block.regions));
    return ground.size() - by_region[regions].size();
  }

  /// Makes the viewpoints of all regions from places along a trajectory.
  Result<void> place_along(const Places& places) {
    const RegionBlock all{every_region(plan_.partition.size()), {}};
    const std::vector<std::uint32_t> owners = owners_in(all, places.own, plan_.partition);
    VANTAGE_TRY(const std::uint64_t inside, place_over(places.own, places.which, all, owners));
    if (inside == 0) {
      return fail(
          ErrorCode::invalid_input,
          "the whole trajectory lies outside all regions, so no viewpoint can be placed: is "
          "the trajectory in the frame of the map?");
    }
    plan_.places_outside = places.which.size() - inside;
    return {};
  }

  Result<void> make_viewpoints(PointsView points, const Groups& groups,
                               const std::vector<std::uint32_t>& regions) {
    std::vector<Result<PointCloud>> made(regions.size());
    tbb::parallel_for(std::size_t{0}, regions.size(), [&](std::size_t g) {
      made[g] = viewpoints_over(points, groups[g], params_.viewpoints);
    });
    for (std::size_t g = 0; g < regions.size(); ++g) {
      VANTAGE_TRY(plan_.viewpoints[regions[g]], std::move(made[g]));
    }
    return {};
  }

  const MapParts& map_;
  const BuildPlugins& plugins_;
  const BuildParams& params_;
  BuildPlan& plan_;
};

}  // namespace

std::vector<std::uint32_t> every_region(std::size_t count) {
  std::vector<std::uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

BuildProgress meter_start(const BuildPlan& plan) noexcept {
  BuildProgress start{.regions = plan.partition.size()};
  for (const PointCloud& viewpoints : plan.viewpoints) start.viewpoints += viewpoints.size();
  return start;
}

Bounds2 needed_area(const BuildPlan& plan, std::uint32_t region, VisibilityScope scope,
                    double reach) {
  Bounds2 around;
  for (const Point& q : plan.viewpoints[region]) around.extend(q.head<2>());
  if (scope == VisibilityScope::region && !plan.viewpoints[region].empty()) {
    around = bounds_of(plan.partition[RegionId{region}].footprint);
  }
  return with_margin(around, reach);
}

double reach_of(const BuildPlugins& plugins, const BuildParams& params,
                const VisibilityLimits& limits) {
  double reach = params.scope == VisibilityScope::map ? plugins.visibility->reach(limits) : 0.0;
  if (params.content != StoredContent::points) reach += plugins.matcher->reach();
  if (plugins.selector) reach = std::max(reach, Selection::reach(params));
  return reach;
}

Result<BuildPlan> plan_of(const MapParts& map, PointsView trajectory, const BuildPlugins& plugins,
                          const BuildParams& params, std::uint64_t memory, const Sight* whole) {
  BuildPlan plan;
  plan.limits = {.map_bounds = map.bounds(), .max_range = params.max_range};
  plan.map_points = map.points();
  if (plan.map_points == 0) return fail(ErrorCode::invalid_input, "the map has no points");
  if (whole == nullptr) VANTAGE_CHECK(check_reaches(plugins, params, plan.limits));

  // Ground (Sec. 2.2), or the driven path. A partitioner may ask about it.
  Stopwatch stopwatch;
  std::optional<Places> places;
  if (whole != nullptr || params.viewpoints.source == ViewpointSource::trajectory) {
    VANTAGE_TRY(places, places_of(whole != nullptr ? whole->map() : PointsView(), trajectory,
                                  plugins.ground.get(), params.outliers, params.viewpoints));
    plan.ground_points = places->ground_points;
    plan.unreachable_voxels = places->unreachable_voxels;
  }
  plan.seconds_ground = stopwatch.seconds();

  // Partition (Sec. 2.1, Eqs. 2-3) and viewpoints (Sec. 2.2, Eqs. 4-5).
  stopwatch = {};
  VANTAGE_TRY(plan.partition,
              partition_of(map, trajectory, plugins, params, plan.limits, memory, whole, places));
  plan.viewpoints.resize(plan.partition.size());
  plan.owned.resize(plan.partition.size());
  VANTAGE_CHECK(Planner(map, plugins, params, plan).run(memory, places));
  places.reset();
  plan.seconds_partition = stopwatch.seconds();
  VANTAGE_TRY(plan.place_index, place_index_of(map, plugins));
  return plan;
}

}  // namespace vantage
