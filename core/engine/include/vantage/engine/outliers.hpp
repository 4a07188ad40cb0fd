#pragma once

#include <cstdint>
#include <tuple>

#include "vantage/api.hpp"
#include "vantage/params.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage {

/// [ground.outliers]: which points the ground filter does not get.
struct OutlierParams {
  std::uint32_t neighbours = 50;
  double ratio = 1.0;

  static constexpr auto schema() {
    constexpr Source kSource{{}, "Rusu et al. 2008"};
    return std::tuple{
        optional("neighbours", &OutlierParams::neighbours, "",
                 "k: each point's mean distance to its k nearest others is compared",
                 between(1, 10'000), kSource),
        optional("ratio", &OutlierParams::ratio, "",
                 "a point is an outlier if its mean distance is more than this many standard "
                 "deviations above the mean of all points",
                 any_number, kSource),
    };
  }
};

/// Leaves statistical outliers out, as PCL's StatisticalOutlierRemoval does: a point stays if its
/// mean distance to its nearest others is at most mean + ratio * standard deviation, both taken
/// over all points. The result depends neither on the order of the points nor on the number of
/// threads.
/// @param points  N finite points, fewer than 2^32 [m]
/// @return        the indices of the points that stay, strictly ascending; may be empty
[[nodiscard]] VANTAGE_API IndexList without_outliers(PointsView points,
                                                     const OutlierParams& params);

}  // namespace vantage
