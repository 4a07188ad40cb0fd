#pragma once

#include <optional>
#include <vector>

#include "vantage/engine/atlas.hpp"
#include "vantage/point_cloud.hpp"
#include "view/colors.hpp"

namespace vantage::view {

/// A site of an atlas as it is drawn, around the scene's origin [m].
struct SiteMark {
  Point at;
  Color color;       ///< of its expected error
  PointCloud weak;   ///< both ends of a line along its weak direction; none without a match
  PointCloud alike;  ///< its alike places
};

/// The sites of a region, or all.
/// @param unit  half the length of a line where all directions are equally strong [m]; a line is
///              longer the larger the ratio of the sigmas is, at most 11 times
[[nodiscard]] std::vector<SiteMark> site_marks(const Atlas& atlas, const Point& origin,
                                               const std::optional<RegionId>& region, double unit);

}  // namespace vantage::view
