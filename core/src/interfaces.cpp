// Home of every interface's vtable and type_info: one of each, in core.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "index_set.hpp"
#include "vantage/ground_filter.hpp"
#include "vantage/map_observer.hpp"
#include "vantage/map_store.hpp"
#include "vantage/partitioner.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/visibility.hpp"

namespace vantage {

MapObserver::~MapObserver() = default;
Partitioner::~Partitioner() = default;
GroundFilter::~GroundFilter() = default;
VisibilityOperator::~VisibilityOperator() = default;
VisibilityProgress::~VisibilityProgress() = default;
VisibilityScene::~VisibilityScene() = default;
MapStore::~MapStore() = default;
ScanMatcher::~ScanMatcher() = default;
MatchTarget::~MatchTarget() = default;

const char* to_string(Termination termination) noexcept {
  switch (termination) {
    case Termination::converged: return "converged";
    case Termination::max_iterations: return "max_iterations";
    case Termination::no_progress: return "no_progress";
  }
  return "unknown";
}

Result<PreparedMap> MatchTarget::excerpt(PointsView /*seen*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher cannot store a prepared map");
}

Result<std::unique_ptr<MatchTarget>> ScanMatcher::restore(
    std::span<const std::byte> /*prepared*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher cannot read a prepared map");
}

Result<IndexList> VisibilityScene::visible_from_any(
    std::span<const Point> viewpoints, const VisibilityProgress* progress) const noexcept {
  // A union does not depend on who comes first; of several errors the one of the first viewpoint is
  // reported.
  IndexSet seen(map_size_);
  std::mutex mutex;
  std::optional<Error> error;
  std::size_t error_at = viewpoints.size();

  tbb::parallel_for(std::size_t{0}, viewpoints.size(), [&](std::size_t i) {
    Result<IndexList> indices = visible(viewpoints[i]);
    if (indices && std::any_of(indices->begin(), indices->end(),
                               [&](std::uint32_t k) { return k >= map_size_; })) {
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
    seen.add(*indices);
    if (progress != nullptr) progress->advanced(1);
  });
  if (error) return fail(*std::move(error));

  return seen.ascending();
}

}  // namespace vantage
