#include "vantage/kit/scene_by_viewpoint.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <utility>

#include "vantage/kit/index_set.hpp"
#include "vantage/plugin.hpp"

namespace vantage {
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

Result<IndexList> SceneByViewpoint::visible_from_any(
    std::span<const Point> viewpoints, const VisibilityProgress* progress) const noexcept {
  return guarded([&]() -> Result<IndexList> {
    IndexSet seen(map_size_);  // a union does not depend on the order
    VANTAGE_CHECK(look_around(*this, map_size_, viewpoints, progress,
                              [&](const IndexList& indices) { seen.add(indices); }));
    return seen.ascending();
  });
}

Result<ViewCounts> SceneByViewpoint::view_counts(
    std::span<const Point> viewpoints, const VisibilityProgress* progress) const noexcept {
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
