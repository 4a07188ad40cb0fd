#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "build/places.hpp"
#include "build/plan_index.hpp"
#include "build/sight.hpp"
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

/// That of a map of which only a part is in memory at a time: every answer is `unsupported`.
class NoSurvey final : public MapSurvey {
 public:
  [[nodiscard]] Result<PointCloud> viewpoints() const noexcept override;
  [[nodiscard]] Result<Bounds3> ground_bounds() const noexcept override;
  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override;
  [[nodiscard]] Result<std::uint64_t> observable_points(
      const Region& region, std::uint64_t enough) const noexcept override;
};

}  // namespace vantage
