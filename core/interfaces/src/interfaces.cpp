// Home of every interface's vtable and type_info, so that each exists once.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/ground_filter.hpp"
#include "vantage/index_set.hpp"
#include "vantage/map_passes.hpp"
#include "vantage/map_store.hpp"
#include "vantage/map_survey.hpp"
#include "vantage/partitioner.hpp"
#include "vantage/plugin.hpp"
#include "vantage/region_directory.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/selector.hpp"
#include "vantage/visibility.hpp"

namespace vantage {

MapSurvey::~MapSurvey() = default;
MapVisitor::~MapVisitor() = default;
MapPasses::~MapPasses() = default;
Partitioner::~Partitioner() = default;
GroundFilter::~GroundFilter() = default;
VisibilityOperator::~VisibilityOperator() = default;
VisibilityProgress::~VisibilityProgress() = default;
VisibilityScene::~VisibilityScene() = default;
MapWriter::~MapWriter() = default;
MapReader::~MapReader() = default;
MapStore::~MapStore() = default;
RegionDirectory::~RegionDirectory() = default;
ScanMatcher::~ScanMatcher() = default;
MatchTarget::~MatchTarget() = default;
Selector::~Selector() = default;
Relocalizer::~Relocalizer() = default;
RelocalizerIndex::~RelocalizerIndex() = default;

const char* to_string(Termination termination) noexcept {
  switch (termination) {
    case Termination::converged: return "converged";
    case Termination::max_iterations: return "max_iterations";
    case Termination::no_progress: return "no_progress";
  }
  return "unknown";
}

Result<void> MapPasses::pass_over(const Bounds2& /*area*/, MapVisitor& visitor) const noexcept {
  return pass(visitor);
}

Result<PointsView> MapPasses::in_memory() const noexcept {
  return fail(ErrorCode::unsupported, "only a part of the map is in memory at a time");
}

double GroundFilter::reach() const noexcept { return std::numeric_limits<double>::infinity(); }

double VisibilityOperator::reach(const VisibilityLimits& /*limits*/) const noexcept {
  return std::numeric_limits<double>::infinity();
}

double ScanMatcher::reach() const noexcept { return std::numeric_limits<double>::infinity(); }

Result<void> MapWriter::attach(std::string_view /*name*/,
                               std::span<const std::byte> /*bytes*/) noexcept {
  return fail(ErrorCode::unsupported, "the store keeps regions only");
}

Result<void> MapReader::attach(std::string_view /*name*/,
                               std::span<const std::byte> /*bytes*/) const noexcept {
  return fail(ErrorCode::unsupported, "the store keeps regions only");
}

Result<std::vector<std::byte>> MapReader::attachment(std::string_view name) const noexcept {
  return fail(ErrorCode::not_found, "the bundle holds no '" + std::string(name) + "'");
}

Result<PreparedMap> MatchTarget::excerpt(PointsView /*seen*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher cannot store a prepared map");
}

Result<std::vector<MapElement>> MatchTarget::elements_at(PointsView /*seen*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher does not tell its elements");
}

Result<std::vector<Pull>> MatchTarget::pulls(PointsView /*scan*/,
                                             const Pose& /*T_map_scan*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher does not tell what its elements do");
}

Result<PreparedMap> MatchTarget::excerpt_of(
    std::span<const std::uint32_t> /*seen*/,
    std::span<const std::uint32_t> /*kept*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher cannot store some of its elements");
}

Result<std::unique_ptr<MatchTarget>> ScanMatcher::restore(
    std::span<const std::byte> /*prepared*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher cannot read a prepared map");
}

namespace {

/// Calls take(visible points) for every viewpoint, in parallel. Of several errors, the one of the
/// first viewpoint is reported.
template <class Take>
Result<void> look_around(const VisibilityScene& scene, std::size_t map_size,
                         std::span<const Point> viewpoints, const VisibilityProgress* progress,
                         const Take& take) {
  std::mutex mutex;
  std::optional<Error> error;
  std::size_t error_at = viewpoints.size();

  tbb::parallel_for(std::size_t{0}, viewpoints.size(), [&](std::size_t i) {
    Result<IndexList> indices = scene.visible(viewpoints[i]);
    if (indices && std::any_of(indices->begin(), indices->end(),
                               [&](std::uint32_t k) { return k >= map_size; })) {
      indices = fail(ErrorCode::internal, "an index of the visible points is beyond the map");
    }
    if (!indices) {
      const std::scoped_lock lock(mutex);
      if (i < error_at) {
        error_at = i;
        error = indices.error();
      }
      return;
    }
    take(*indices);
    if (progress != nullptr) progress->advanced(1);
  });
  if (error) return fail(*std::move(error));
  return {};
}

}  // namespace

Result<IndexList> VisibilityScene::visible_from_any(
    std::span<const Point> viewpoints, const VisibilityProgress* progress) const noexcept {
  return guarded([&]() -> Result<IndexList> {
    IndexSet seen(map_size_);  // a union does not depend on the order
    VANTAGE_CHECK(look_around(*this, map_size_, viewpoints, progress,
                              [&](const IndexList& indices) { seen.add(indices); }));
    return seen.ascending();
  });
}

Result<ViewCounts> VisibilityScene::view_counts(std::span<const Point> viewpoints,
                                                const VisibilityProgress* progress) const noexcept {
  return guarded([&]() -> Result<ViewCounts> {
    IndexSet seen(map_size_);
    // Not a vector: counters of ranges in which nothing is seen take no memory.
    const std::unique_ptr<std::uint32_t, decltype(&std::free)> counters(
        static_cast<std::uint32_t*>(std::calloc(map_size_, sizeof(std::uint32_t))), &std::free);
    if (map_size_ > 0 && !counters) throw std::bad_alloc();
    VANTAGE_CHECK(
        look_around(*this, map_size_, viewpoints, progress, [&](const IndexList& indices) {
          seen.add(indices);
          for (const std::uint32_t k : indices) ++std::atomic_ref(counters.get()[k]);
        }));
    ViewCounts counts{.points = seen.ascending(), .views = {}};
    counts.views.reserve(counts.points.size());
    for (const std::uint32_t k : counts.points) counts.views.push_back(counters.get()[k]);
    return counts;
  });
}

}  // namespace vantage
