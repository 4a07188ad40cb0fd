#pragma once

#include "vantage/api.hpp"
#include "vantage/map_passes.hpp"
#include "vantage/map_survey.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Cuts the wide-area map into local regions (Sec. 2.1).
/// Thread safety: `partition` may run on one object from many threads at once.
/// Errors: `invalid_input` for an empty map, a non-finite coordinate of a map point, or a missing
/// trajectory if this partitioner needs one; errors of the map and of the survey, among them
/// `unsupported` if a map that is not in memory does not give what this partitioner needs.
class VANTAGE_API Partitioner {
 public:
  virtual ~Partitioner();

  /// @param map         the N points of the wide-area map P, map frame, z up [m]; finite
  /// @param trajectory  positions of the sensor while mapping, in driving order [m]; may be empty
  /// @param survey      answers what can be seen in this map; most partitioners do not need it
  /// @return            regions that together own every point of `map`; each owns at least one.
  ///                    Their order and footprints depend neither on the order of the points nor
  ///                    on whether they are in memory
  [[nodiscard]] virtual Result<Partition> partition(const MapPasses& map, PointsView trajectory,
                                                    const MapSurvey& survey) const noexcept = 0;
};

}  // namespace vantage
