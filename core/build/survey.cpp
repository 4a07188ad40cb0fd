#include "build/survey.hpp"

#include <tbb/task_arena.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "build/blocks.hpp"
#include "build/plan.hpp"
#include "vantage/plugin.hpp"

namespace vantage {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Bounds2 kEverywhere{Eigen::Vector2d::Constant(-kInfinity),
                          Eigen::Vector2d::Constant(kInfinity)};

constexpr double kBlock = 100.0;  // of a block that answers for a larger region: its width [m]

bool is_within(const Bounds2& inner, const Bounds2& outer) {
  return outer.contains(inner.min) && outer.contains(inner.max);
}

// Copies of the ground, and what finds it and the points of a region [bytes a point].
constexpr std::uint64_t kBytesAPlace = 32;

/// The points that lie in an area, its upper ends not included.
std::uint64_t count_in(const Bounds2& area, PointsView points, const IndexList& which) {
  const Footprint box = HalfOpenBox{area.min, area.max};
  return static_cast<std::uint64_t>(std::ranges::count_if(
      which, [&](std::uint32_t k) { return contains(box, points[k].head<2>()); }));
}

/// The points that a region owns, among those in an index over `points`.
IndexList owned(const Region& region, PointsView points, const PlanIndex& index) {
  const Bounds2 bounds = bounds_of(region.footprint);
  IndexList inside = index.near(bounds.min, bounds.max);
  std::erase_if(inside, [&](std::uint32_t k) {
    const Point& p = points[k];
    return !region.height.contains(p.z()) || !contains(region.footprint, p.head<2>());
  });
  return inside;
}

tl::unexpected<Error> not_surveyed(const std::string& what) {
  return fail(ErrorCode::unsupported, what + " is known only once the whole map is in memory");
}

}  // namespace

Result<PointCloud> BuildSurvey::viewpoints() const noexcept {
  return guarded(
      [&] { return viewpoints_over(places_.points, places_.which, params_.viewpoints); });
}

Result<Bounds3> BuildSurvey::ground_bounds() const noexcept {
  if (places_.ground_points == 0) {
    return fail(ErrorCode::unsupported,
                "viewpoints.source = \"trajectory\" finds no ground, so the ground has no bounds");
  }
  Bounds3 bounds;
  for (const std::uint32_t k : places_.which) bounds.extend(places_.points[k]);
  return bounds;
}

Result<IndexList> BuildSurvey::visible(const Point& viewpoint) const noexcept {
  return guarded([&] { return sight_.visible(viewpoint); });
}

Result<std::uint64_t> BuildSurvey::observable_points(const Region& region,
                                                     std::uint64_t enough) const noexcept {
  return guarded([&]() -> Result<std::uint64_t> {
    return seen_from(kEverywhere, region, enough).map(&IndexList::size);
  });
}

Result<IndexList> BuildSurvey::seen_from(const Bounds2& area, const Region& region,
                                         std::uint64_t enough) const {
  IndexList places = owned(region, places_.points, index_of_places());  // g_ij
  std::erase_if(places,
                [&](std::uint32_t k) { return !area.contains(places_.points[k].head<2>()); });
  VANTAGE_TRY(PointCloud viewpoints, viewpoints_over(places_.points, places, params_.viewpoints));
  // A voxel that reaches out of the area may have other ground there.
  const Bounds2 inner = with_margin(area, -params_.viewpoints.voxel_size);
  std::erase_if(viewpoints, [&](const Point& q) { return !inner.contains(q.head<2>()); });
  IndexList inside;  // P_ij
  if (params_.scope == VisibilityScope::region && !viewpoints.empty()) {
    inside = owned(region, map_, index_of_map());
    if (inside.empty()) return IndexList();
  }
  return sight_.seen(inside, viewpoints, enough);
}

const PlanIndex& BuildSurvey::index_of_places() const {
  std::call_once(places_indexed_, [&] {
    place_index_.emplace(places_.points, places_.which.size(),
                         [&](std::size_t i) { return places_.which[i]; });
  });
  return *place_index_;
}

const PlanIndex& BuildSurvey::index_of_map() const {
  std::call_once(map_indexed_, [&] {
    map_index_.emplace(map_, map_.size(),
                       [](std::size_t k) { return static_cast<std::uint32_t>(k); });
  });
  return *map_index_;
}

/// What is seen from the places in an area of the map.
struct BlockSurvey::Block {
  Bounds2 area;
  MapPart part;
  Places places;
  std::optional<Sight> sight;
  std::optional<BuildSurvey> survey;
};

BlockSurvey::BlockSurvey(const MapParts& map, const BuildPlugins& plugins,
                         const BuildParams& params, const VisibilityLimits& limits,
                         const std::optional<Places>& places, std::uint64_t memory)
    : map_(map),
      plugins_(plugins),
      params_(params),
      limits_(limits),
      driven_(places),
      memory_(memory),
      sight_reach_(params.scope == VisibilityScope::map ? plugins.visibility->reach(limits) : 0.0) {
}
BlockSurvey::~BlockSurvey() = default;

Result<PointCloud> BlockSurvey::viewpoints() const noexcept { return not_surveyed("viewpoints"); }
Result<Bounds3> BlockSurvey::ground_bounds() const noexcept { return not_surveyed("the ground"); }
Result<IndexList> BlockSurvey::visible(const Point& /*viewpoint*/) const noexcept {
  return not_surveyed("what a viewpoint sees");
}

Result<std::uint64_t> BlockSurvey::observable_points(const Region& region,
                                                     std::uint64_t enough) const noexcept {
  return guarded([&]() -> Result<std::uint64_t> {
    if (std::string defect = defect_of(region); !defect.empty()) {
      return fail(ErrorCode::invalid_input, std::move(defect));
    }
    const std::scoped_lock lock(mutex_);
    // Isolated: a task that this thread takes up while it waits must not come here.
    return tbb::this_task_arena::isolate([&] { return observable(region, enough); });
  });
}

Result<std::uint64_t> BlockSurvey::observable(const Region& region, std::uint64_t enough) const {
  const Bounds2 area = bounds_of(region.footprint);
  const Need need = need_of(area);
  if (fits(need)) {
    if (!block_ || !is_within(area, block_->area)) VANTAGE_CHECK(see(area));
    return block_->survey->observable_points(region, enough);
  }
  // With min_views, min_gain or a region's own points alone, a block may show what its region does
  // not show.
  const bool adds_up = params_.scope == VisibilityScope::map && params_.min_views == 1 &&
                       params_.viewpoints.min_gain == 0.0;
  std::uint64_t in_blocks = 0;  // what a block shows of itself
  for (const Bounds2& block : adds_up ? blocks_in(area) : std::vector<Bounds2>()) {
    VANTAGE_CHECK(see(block));
    VANTAGE_TRY(const IndexList seen, block_->survey->seen_from(block, region, enough));
    if (seen.size() > enough) return seen.size();
    in_blocks += count_in(block, block_->part.points(), seen);
    if (in_blocks > enough) return in_blocks;
  }
  return does_not_fit(region.label, need.points, memory_, need.bytes_a_point);
}

/// Finds the places in an area, and then reads what is seen from there.
Result<void> BlockSurvey::see(const Bounds2& area) const {
  block_.reset();  // before the next one is read
  auto block = std::make_unique<Block>();
  block->area = area;
  if (driven_) {
    block->places.points = driven_->points;
    block->places.which = driven_->which;
  } else {
    VANTAGE_TRY(const MapPart around, map_.read(with_margin(area, plugins_.ground->reach())));
    const PointsView points = around.points();
    if (!points.empty()) {
      VANTAGE_TRY(const IndexList ground, ground_in(points, *plugins_.ground, {}));
      for (const std::uint32_t k : ground) {
        if (area.contains(points[k].head<2>())) block->places.own.push_back(points[k]);
      }
    }
    block->places.points = block->places.own;
    block->places.which = every_region(block->places.own.size());
  }
  VANTAGE_TRY(block->part, map_.read(with_margin(area, sight_reach_)));
  const PointsView points = block->part.points();
  block->sight.emplace(points, limits_, plugins_.visibility, params_);
  block->survey.emplace(points, block->places, *block->sight, params_);
  block_ = std::move(block);
  return {};
}

/// Small blocks of an area that fit into the memory, those with the most points first.
std::vector<Bounds2> BlockSurvey::blocks_in(const Bounds2& area) const {
  struct Candidate {
    Bounds2 area;
    std::uint64_t points;
  };
  std::vector<Candidate> candidates;
  std::vector<Bounds2> open{area};
  while (!open.empty()) {
    const Bounds2 next = open.back();
    open.pop_back();
    const Eigen::Vector2d size = next.max - next.min;
    const Eigen::Index axis = size.x() >= size.y() ? 0 : 1;
    const Need need = need_of(next);
    if (need.points == 0) continue;
    if (fits(need) && size[axis] <= std::max(kBlock, 8.0 * params_.viewpoints.voxel_size)) {
      candidates.push_back({next, need.points});
      continue;
    }
    if (!fits(need) && size[axis] <= 4.0 * params_.viewpoints.voxel_size) continue;  // too dense
    Bounds2 below = next, above = next;
    below.max[axis] = above.min[axis] = 0.5 * (next.min[axis] + next.max[axis]);
    open.push_back(above);
    open.push_back(below);
  }
  std::ranges::stable_sort(candidates, std::greater{}, &Candidate::points);
  std::vector<Bounds2> areas;
  for (const Candidate& candidate : candidates) areas.push_back(candidate.area);
  return areas;
}

/// What seeing an area takes: its ground or its sight, whichever is more.
BlockSurvey::Need BlockSurvey::need_of(const Bounds2& area) const {
  const Need sight{map_.points_in(with_margin(area, sight_reach_)),
                   kBytesASeenPoint + kBytesAPlace};
  if (driven_) return sight;
  const Need ground{map_.points_in(with_margin(area, plugins_.ground->reach())),
                    kBytesAGroundPoint};
  return ground.bytes() > sight.bytes() ? ground : sight;
}

bool BlockSurvey::fits(const Need& need) const {
  return need.bytes() <= memory_ && need.points <= kMostBlockPoints;
}

}  // namespace vantage
