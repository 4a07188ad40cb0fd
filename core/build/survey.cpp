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

constexpr double kSample = 100.0;  // a block that answers for a larger region is as wide [m]

// What a point of a block takes while a partitioner asks: ground and sight at once [bytes].
constexpr std::uint64_t kBytesAnAskedPoint = kBytesAGroundPoint + kBytesASeenPoint;

std::uint64_t most_points(std::uint64_t memory) {
  return std::min(memory / kBytesAnAskedPoint, kMostBlockPoints);
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
  return guarded([&] { return observable_within(kEverywhere, region, enough); });
}

Result<std::uint64_t> BuildSurvey::observable_within(const Bounds2& area, const Region& region,
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
  }
  return sight_.count(inside, viewpoints, enough);
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
      places_(places),
      memory_(memory),
      margin_(std::max(params.scope == VisibilityScope::map ? plugins.visibility->reach(limits) : 0,
                       places ? 0.0 : plugins.ground->reach())) {}
BlockSurvey::~BlockSurvey() = default;

Result<PointCloud> BlockSurvey::viewpoints() const noexcept { return not_surveyed("viewpoints"); }
Result<Bounds3> BlockSurvey::ground_bounds() const noexcept { return not_surveyed("the ground"); }
Result<IndexList> BlockSurvey::visible(const Point& /*viewpoint*/) const noexcept {
  return not_surveyed("what a viewpoint sees");
}

Result<std::uint64_t> BlockSurvey::observable_points(const Region& region,
                                                     std::uint64_t enough) const noexcept {
  return guarded([&]() -> Result<std::uint64_t> {
    const std::scoped_lock lock(mutex_);
    // Isolated: a task that this thread takes up while it waits must not come here.
    return tbb::this_task_arena::isolate([&] { return observable(region, enough); });
  });
}

Result<std::uint64_t> BlockSurvey::observable(const Region& region, std::uint64_t enough) const {
  const Bounds2 area = bounds_of(region.footprint);
  const std::uint64_t points = points_around(area);
  if (points <= most_points(memory_)) {
    if (!block_ || !(block_->area.contains(area.min) && block_->area.contains(area.max))) {
      VANTAGE_CHECK(see(area));
    }
    return block_->survey->observable_points(region, enough);
  }
  for (const Bounds2& sample : samples_of(area)) {
    VANTAGE_CHECK(see(sample));
    VANTAGE_TRY(const auto seen, block_->survey->observable_within(sample, region, enough));
    if (seen > enough) return seen;
  }
  return does_not_fit(region.label, points, memory_, kBytesAnAskedPoint);
}

/// Reads the block around an area, and finds its places.
Result<void> BlockSurvey::see(const Bounds2& area) const {
  block_.reset();  // before the next one is read
  auto block = std::make_unique<Block>();
  block->area = area;
  VANTAGE_TRY(block->part, map_.read(with_margin(area, margin_)));
  const PointsView points = block->part.points();
  if (places_) {
    block->places.points = places_->points;
    block->places.which = places_->which;
  } else if (!points.empty()) {
    block->places.points = points;
    VANTAGE_TRY(block->places.which, ground_in(points, *plugins_.ground, {}));
  }
  block->sight.emplace(points, limits_, plugins_.visibility, params_);
  block->survey.emplace(points, block->places, *block->sight, params_);
  block_ = std::move(block);
  return {};
}

/// Blocks of an area that fit into the memory, those with the most points first. They are not
/// larger than it takes to see what is around a place.
std::vector<Bounds2> BlockSurvey::samples_of(const Bounds2& area) const {
  struct Sample {
    Bounds2 area;
    std::uint64_t points;
  };
  std::vector<Sample> samples;
  std::vector<Bounds2> open{area};
  while (!open.empty()) {
    const Bounds2 next = open.back();
    open.pop_back();
    const Eigen::Vector2d size = next.max - next.min;
    const Eigen::Index axis = size.x() >= size.y() ? 0 : 1;
    const std::uint64_t points = points_around(next);
    if (points == 0) continue;
    if (points <= most_points(memory_) && size[axis] <= std::max(2 * margin_, kSample)) {
      samples.push_back({next, points});
      continue;
    }
    if (size[axis] <= 4 * params_.viewpoints.voxel_size) continue;  // too dense
    Bounds2 below = next, above = next;
    below.max[axis] = above.min[axis] = 0.5 * (next.min[axis] + next.max[axis]);
    open.push_back(above);
    open.push_back(below);
  }
  std::ranges::stable_sort(samples, std::greater{}, &Sample::points);
  std::vector<Bounds2> areas;
  for (const Sample& sample : samples) areas.push_back(sample.area);
  return areas;
}

std::uint64_t BlockSurvey::points_around(const Bounds2& area) const {
  return map_.points_in(with_margin(area, margin_));
}

}  // namespace vantage
