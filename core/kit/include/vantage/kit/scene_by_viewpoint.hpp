#pragma once

#include <cstddef>
#include <span>

#include "vantage/visibility.hpp"

namespace vantage {

/// A scene that answers for many viewpoints by asking `visible` for each, in parallel. Of several
/// errors, the one of the first viewpoint is reported. An operator that can share work between
/// viewpoints overrides `visible_from_any`, `view_counts` or both.
class SceneByViewpoint : public VisibilityScene {
 public:
  /// Reports each viewpoint that is done.
  [[nodiscard]] Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress = nullptr) const noexcept override;

  /// Reports each viewpoint that is done. Needs 4 more bytes per map point.
  [[nodiscard]] Result<ViewCounts> view_counts(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress = nullptr) const noexcept override;

 protected:
  /// @param map_size  number of points of the map that the scene was prepared for
  explicit SceneByViewpoint(std::size_t map_size) noexcept : map_size_(map_size) {}

 private:
  std::size_t map_size_;
};

}  // namespace vantage
