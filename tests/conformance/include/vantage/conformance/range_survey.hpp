#pragma once

#include <map>
#include <utility>

#include "vantage/map_survey.hpp"

namespace vantage::conformance {

/// A survey so simple that its answers can be worked out by hand. One viewpoint stands 1 m above
/// the lowest point of every occupied 2 m cell, and sees what is within its range. The ground is
/// those lowest points.
class RangeSurvey final : public MapSurvey {
 public:
  /// What `observable_points` returns if there are more than `enough`.
  enum class AboveEnough { exact, one_more, most };
  /// @param map    N points [m]; borrowed
  /// @param range  how far a viewpoint sees [m]
  RangeSurvey(PointsView map, double range, AboveEnough above = AboveEnough::exact)
      : map_(map), range_(range), above_(above) {}

  [[nodiscard]] Result<PointCloud> viewpoints() const noexcept override;
  [[nodiscard]] Result<Bounds3> ground_bounds() const noexcept override;
  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override;
  [[nodiscard]] Result<std::uint64_t> observable_points(
      const Region& region, std::uint64_t enough) const noexcept override;

 private:
  [[nodiscard]] std::map<std::pair<double, double>, double> lowest_in(const Region* region) const;
  [[nodiscard]] PointCloud viewpoints_in(const Region* region) const;

  PointsView map_;
  double range_;
  AboveEnough above_;
};

}  // namespace vantage::conformance
