#pragma once

#include "vantage/api.hpp"
#include "vantage/engine/build_params.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage {

/// Thins points evenly. Each voxel keeps the point nearest to the mean of its points; of equally
/// near points, the first by x, then y, then z. Voxels are anchored at the origin of the frame, so
/// that the maps of neighbouring regions share them. The result depends neither on the order of the
/// points nor on the number of threads.
/// @param map         finite points [m]
/// @param candidates  indices into `map`, strictly ascending
/// @return            the candidates that stay, strictly ascending
/// Precondition: `params` is valid.
[[nodiscard]] VANTAGE_API IndexList thinned(PointsView map, IndexList candidates,
                                            const ThinningParams& params);

}  // namespace vantage
