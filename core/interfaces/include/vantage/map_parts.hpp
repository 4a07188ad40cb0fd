#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/map_passes.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A part of a map, and which of the map's points it has.
struct MapPart {
  /// Points that follow each other in the map, too: those from `begin` to that of the next run.
  struct Run {
    std::uint64_t rank = 0;  ///< of the first point, among all points of the map
    std::size_t begin = 0;   ///< of the first point, in `points`
  };
  PointCloud points;
  std::vector<Run> runs;  ///< in ascending order
};

/// A wide-area map of which only parts are in memory at a time.
/// Thread safety: the const methods below may run on one object from many threads at once.
class VANTAGE_API MapParts : public MapPasses {
 public:
  ~MapParts() override;

  /// How many points `read` gives for an area.
  [[nodiscard]] virtual std::uint64_t points_in(const Bounds2& area) const = 0;
  /// All points in an area, and some around it, by their ranks.
  /// Errors: `io_failure`, `corrupt_data`.
  [[nodiscard]] virtual Result<MapPart> read(const Bounds2& area) const = 0;
};

}  // namespace vantage
