#pragma once

#include <cstdint>

#include "vantage/api.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What a partitioner may ask of the build about the map it cuts: the ground, the viewpoints and
/// the visibility that the region maps will be made with. So regions can be cut by what is seen in
/// them. Thread safety: const methods may run on one object from many threads at once.
class VANTAGE_API MapObserver {
 public:
  virtual ~MapObserver();

  /// Virtual viewpoints q over the ground of the whole map (Eqs. 4-5) or along its trajectory, map
  /// frame [m]; may be empty.
  [[nodiscard]] virtual Result<PointCloud> viewpoints() const noexcept = 0;

  /// B_q of Eq. 9, decided among all points of the map.
  /// @param viewpoint  map frame [m]; `invalid_input` if not finite
  /// @return           indices into the map, strictly ascending
  [[nodiscard]] virtual Result<IndexList> visible(const Point& viewpoint) const noexcept = 0;

  /// |V_ij| of Eq. 10: how many points the observable map of `region` will hold, if the region owns
  /// every place in its footprint and heights. All viewpoints are asked, also those that the build
  /// will skip (`viewpoints.min_gain`), so its map may hold fewer.
  /// @param enough  a larger result need not be exact: counting ends once more than this are seen
  /// @return        exact if not above `enough`; the same for any number of threads
  [[nodiscard]] virtual Result<std::uint64_t> observable_points(
      const Region& region, std::uint64_t enough) const noexcept = 0;
};

}  // namespace vantage
