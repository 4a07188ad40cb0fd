#pragma once

#include <cstdint>

#include "vantage/api.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What a partitioner may ask about the map it cuts. The build answers with the ground, the
/// viewpoints and the visibility that it makes the region maps with, so regions can be cut by what
/// is seen in them. Answers are the same for any number of threads.
/// Thread safety: const methods may run on one object from many threads at once.
class VANTAGE_API MapSurvey {
 public:
  virtual ~MapSurvey();

  /// Virtual viewpoints q over the ground of the whole map (Eqs. 4-5) or along its trajectory, map
  /// frame [m]; may be empty. A voxel on the border of two regions has one viewpoint here, and one
  /// in each of the regions later.
  [[nodiscard]] virtual Result<PointCloud> viewpoints() const noexcept = 0;

  /// B_q of Eq. 9, decided among all points of the map.
  /// @param viewpoint  map frame [m]; `invalid_input` if not finite
  /// @return           indices into the map, strictly ascending
  [[nodiscard]] virtual Result<IndexList> visible(const Point& viewpoint) const noexcept = 0;

  /// |V_ij| of Eq. 10: how many points the observable map of `region` will hold, before it is
  /// thinned. The build counts with the code that makes the map, and asks the viewpoints that it
  /// will ask then: `min_views` and `min_gain` count as they do there.
  /// Cost: the visibility of the region, unless counting ends early. The build keeps nothing of it
  /// and sees the region again.
  /// @param region  counted as if it owned every place in its footprint and heights; where a region
  ///                of a lower id overlaps it, its map holds something else
  /// @param enough  counting may end once more than this are seen: ask for no more than you need
  /// @return        exact if not above `enough`, else any number above `enough`
  [[nodiscard]] virtual Result<std::uint64_t> observable_points(
      const Region& region, std::uint64_t enough) const noexcept = 0;
};

}  // namespace vantage
