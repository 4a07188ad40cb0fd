#include "build/plan.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <variant>

#include "build/blocks.hpp"
#include "build/cut.hpp"
#include "build/places.hpp"
#include "build/plugin_checks.hpp"
#include "build/selection.hpp"
#include "build/viewpoint_origin.hpp"

namespace vantage {
namespace {

// What finding the ground takes for each point, with the point itself [bytes].
constexpr std::uint64_t kBytesAGroundPoint = 56;

tl::unexpected<Error> needs_whole_map(const std::string& what, const std::string& instead) {
  return fail(ErrorCode::unsupported, what +
                                          " needs the whole map at once, but a tiled map is built "
                                          "part by part: " +
                                          instead);
}

Result<void> check_reaches(const BuildPlugins& plugins, const BuildParams& params,
                           const VisibilityLimits& limits) {
  if (std::holds_alternative<OverReachableGround>(origin_of(params.viewpoints))) {
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

std::vector<std::uint32_t> every_region(std::size_t count) {
  std::vector<std::uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0U);
  return all;
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
    if (largest.points <= memory / kBytesASeenPoint) return {};
    return does_not_fit(plan_.partition, largest, memory, kBytesASeenPoint,
                        kBytesASeenPoint * *std::ranges::max_element(points_));
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

  /// @param over_ground  whether viewpoints stand over the ground of the blocks
  Result<void> run(std::uint64_t memory, bool over_ground) {
    const double margin = over_ground ? plugins_.ground->reach() : 0.0;
    std::vector<Bounds2> areas;
    for (const Region& region : plan_.partition.regions()) {
      areas.push_back(with_margin(bounds_of(region.footprint), margin));
    }
    const std::vector<std::uint32_t> all = every_region(areas.size());
    VANTAGE_TRY(auto blocks,
                blocks_of(map_, plan_.partition, all, areas, memory, kBytesAGroundPoint));
    Needs needs(map_, plan_, params_.scope, reach_of(plugins_, params_, plan_.limits));
    if (over_ground) {
      needs.put_first(blocks);
    } else {
      VANTAGE_CHECK(needs.check(all, memory));
    }
    block_of_.resize(plan_.partition.size());
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      for (const std::uint32_t r : blocks[b].regions) block_of_[r] = b;
    }
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      VANTAGE_TRY(const MapPart part, map_.read(blocks[b].area));
      const PointCloud& points = part.points;
      const std::vector<std::uint32_t> owners = owners_in(b, points);
      for (std::size_t k = 0; k < points.size(); ++k) {
        if (owners[k] == kNobody) continue;
        ++owned_;
        ++plan_.owned[owners[k]];
      }
      if (!over_ground) continue;
      VANTAGE_CHECK(find_viewpoints(blocks[b], points, owners));
      VANTAGE_CHECK(needs.check(blocks[b].regions, memory));
    }
    if (owned_ != map_.points()) {
      return fail(ErrorCode::internal,
                  "the partitioner plugin broke its contract: its regions own " +
                      std::to_string(owned_) + " of the " + std::to_string(map_.points()) +
                      " map points");
    }
    if (over_ground && plan_.ground_points == 0) return no_ground();
    return {};
  }

 private:
  static constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

  /// The region of each point, if the region is in the block.
  [[nodiscard]] std::vector<std::uint32_t> owners_in(std::uint32_t block, PointsView points) const {
    std::vector<std::uint32_t> owners(points.size(), kNobody);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size()), [&](const auto& range) {
      for (std::size_t k = range.begin(); k != range.end(); ++k) {
        const auto region = plan_.partition.locate(points[k]);
        if (region && block_of_[region->value] == block) owners[k] = region->value;
      }
    });
    return owners;
  }

  Result<void> find_viewpoints(const RegionBlock& block, PointsView points,
                               const std::vector<std::uint32_t>& owners) {
    if (points.empty()) return {};
    VANTAGE_TRY(IndexList ground, plugins_.ground->ground(points));
    VANTAGE_CHECK(check_indices(ground, points.size(), "ground"));
    std::erase_if(ground, [&](std::uint32_t k) { return owners[k] == kNobody; });
    plan_.ground_points += ground.size();
    const Groups by_region = grouped(
        ground.size(), block.regions.size(), [&](std::size_t i) { return ground[i]; },
        [&](std::uint32_t k) {
          return std::ranges::lower_bound(block.regions, owners[k]) - block.regions.begin();
        });
    return viewpoints_of_groups(points, by_region, block.regions, params_.viewpoints,
                                plan_.viewpoints);
  }

  const MapParts& map_;
  const BuildPlugins& plugins_;
  const BuildParams& params_;
  BuildPlan& plan_;
  std::vector<std::uint32_t> block_of_;  // by region
  std::uint64_t owned_ = 0;              // points
};

}  // namespace

Result<std::vector<std::byte>> place_index_of(const MapPasses& map, const BuildPlugins& plugins) {
  if (!plugins.relocalizer) return std::vector<std::byte>();
  auto index = plugins.relocalizer->index(map);
  if (!index && index.error().code == ErrorCode::unsupported) return std::vector<std::byte>();
  return index;
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
                          const BuildParams& params, std::uint64_t memory) {
  BuildPlan plan;
  plan.limits = {.map_bounds = map.bounds(), .max_range = params.max_range};
  plan.map_points = map.points();
  if (plan.map_points == 0) return fail(ErrorCode::invalid_input, "the map has no points");
  VANTAGE_CHECK(check_reaches(plugins, params, plan.limits));
  auto partition = plugins.partitioner->partition_in_passes(map, trajectory);
  if (!partition && partition.error().code == ErrorCode::unsupported) {
    return needs_whole_map("the plugin of [partitioner]",
                           "choose another one (" + partition.error().message + ")");
  }
  VANTAGE_TRY(plan.partition, std::move(partition));
  plan.viewpoints.resize(plan.partition.size());
  plan.owned.resize(plan.partition.size());
  const bool over_ground = !std::holds_alternative<AlongTrajectory>(origin_of(params.viewpoints));
  if (!over_ground) {
    VANTAGE_TRY(const Places places, places_of({}, trajectory, nullptr, {}, params.viewpoints));
    VANTAGE_TRY(plan.places_outside,
                viewpoints_along(places, plan.partition, params.viewpoints, plan.viewpoints));
  }
  VANTAGE_CHECK(Planner(map, plugins, params, plan).run(memory, over_ground));
  VANTAGE_TRY(plan.place_index, place_index_of(map, plugins));
  return plan;
}

}  // namespace vantage
