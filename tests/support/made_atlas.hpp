#pragma once

#include "vantage/engine/atlas.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::test {

/// An atlas of four sites in region 0, 10 m apart along x from `first`: a good one; one that is
/// weak along a direction 30 degrees from the x axis; one with two alike places, 20 m behind it
/// and 5 m ahead of it; one where a scan matches nothing.
[[nodiscard]] Atlas made_atlas(const Point& first);

}  // namespace vantage::test
