#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <variant>
#include <vector>

#include "vantage/map_passes.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A part of a map, and which of the map's points it has.
class MapPart {
 public:
  /// Points that follow each other in the map, too: those from `begin` to that of the next run.
  struct Run {
    std::uint64_t rank = 0;  ///< of the first point, among all points of the map
    std::size_t begin = 0;   ///< of the first point, in `points`
  };

  MapPart() = default;
  /// @param runs  in ascending order
  MapPart(PointCloud points, std::vector<Run> runs)
      : points_(std::move(points)), runs_(std::move(runs)) {}
  /// All of a map in memory, which is borrowed.
  explicit MapPart(PointsView map) : points_(map), runs_{{0, 0}} {}

  [[nodiscard]] PointsView points() const noexcept {
    return std::visit([](const auto& points) { return PointsView(points); }, points_);
  }
  [[nodiscard]] const std::vector<Run>& runs() const noexcept { return runs_; }

 private:
  std::variant<PointCloud, PointsView> points_;
  std::vector<Run> runs_;
};

/// A wide-area map of which only parts are in memory at a time.
/// Thread safety: the const methods below may run on one object from many threads at once.
class MapParts : public MapPasses {
 public:
  ~MapParts() override = default;

  /// How many points `read` gives for an area.
  [[nodiscard]] virtual std::uint64_t points_in(const Bounds2& area) const = 0;
  /// All points in an area, and some around it, by their ranks.
  /// Errors: `io_failure`, `corrupt_data`.
  [[nodiscard]] virtual Result<MapPart> read(const Bounds2& area) const = 0;
};

}  // namespace vantage
