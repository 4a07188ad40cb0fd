#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "build/places.hpp"
#include "build/plan_index.hpp"
#include "build/sight.hpp"
#include "vantage/kit/map_parts.hpp"
#include "vantage/map_survey.hpp"

namespace vantage {

/// Answers a partitioner from the same places and sight that the build uses later.
class BuildSurvey final : public MapSurvey {
 public:
  /// All arguments are borrowed.
  BuildSurvey(PointsView map, const Places& places, const Sight& sight, const BuildParams& params)
      : map_(map), places_(places), sight_(sight), params_(params) {}

  [[nodiscard]] Result<PointCloud> viewpoints() const noexcept override;
  [[nodiscard]] Result<Bounds3> ground_bounds() const noexcept override;
  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override;
  [[nodiscard]] Result<std::uint64_t> observable_points(
      const Region& region, std::uint64_t enough) const noexcept override;

  /// What is seen from those viewpoints of a region alone that the places in an area decide about.
  /// @param enough  a part of it suffices above this number of points
  [[nodiscard]] Result<IndexList> seen_from(const Bounds2& area, const Region& region,
                                            std::uint64_t enough) const;

 private:
  [[nodiscard]] const PlanIndex& index_of_places() const;
  [[nodiscard]] const PlanIndex& index_of_map() const;

  PointsView map_;
  const Places& places_;
  const Sight& sight_;
  const BuildParams& params_;
  // Only a partitioner that asks about regions needs these.
  mutable std::once_flag places_indexed_, map_indexed_;
  mutable std::optional<PlanIndex> place_index_, map_index_;
};

/// That of a map of which only a part is in memory at a time. It counts what regions show, from the
/// block of the map around them; the block of a region serves the regions that it is cut into. What
/// is asked about the whole map is `unsupported`.
class BlockSurvey final : public MapSurvey {
 public:
  /// All arguments are borrowed.
  /// @param places  along a trajectory; none: ground is sought in each block
  /// @param memory  for a block [bytes]
  BlockSurvey(const MapParts& map, const BuildPlugins& plugins, const BuildParams& params,
              const VisibilityLimits& limits, const std::optional<Places>& places,
              std::uint64_t memory);
  ~BlockSurvey() override;

  [[nodiscard]] Result<PointCloud> viewpoints() const noexcept override;
  [[nodiscard]] Result<Bounds3> ground_bounds() const noexcept override;
  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override;
  /// Errors: also `invalid_input` for a malformed region, and for one that does not fit into the
  /// memory unless its blocks show more than `enough` points. With min_views, min_gain or
  /// VisibilityScope::region, blocks cannot show that.
  [[nodiscard]] Result<std::uint64_t> observable_points(
      const Region& region, std::uint64_t enough) const noexcept override;

 private:
  struct Block;
  struct Need {
    std::uint64_t points = 0, bytes_a_point = 0;
    [[nodiscard]] std::uint64_t bytes() const noexcept { return points * bytes_a_point; }
  };
  [[nodiscard]] Result<std::uint64_t> observable(const Region& region, std::uint64_t enough) const;
  [[nodiscard]] Result<void> see(const Bounds2& area) const;
  [[nodiscard]] std::vector<Bounds2> blocks_in(const Bounds2& area) const;
  [[nodiscard]] Need need_of(const Bounds2& area) const;
  [[nodiscard]] bool fits(const Need& need) const;

  const MapParts& map_;
  const BuildPlugins& plugins_;
  const BuildParams& params_;
  const VisibilityLimits& limits_;
  const std::optional<Places>& driven_;
  std::uint64_t memory_;
  double sight_reach_;  // [m]
  mutable std::mutex mutex_;
  mutable std::unique_ptr<Block> block_;  // the last one
};

}  // namespace vantage
