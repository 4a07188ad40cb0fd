#pragma once

#include <cstdint>

#include "vantage/api.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Receives the points of a map, part by part.
class VANTAGE_API MapVisitor {
 public:
  virtual ~MapVisitor();

  /// @param points  some points of the map, map frame [m]; finite; borrowed for this call only
  /// Errors end the pass.
  [[nodiscard]] virtual Result<void> see(PointsView points) noexcept = 0;
};

/// A map, of which only a part may be in memory at a time. It can be passed over more than once;
/// each pass reads the whole map.
/// Thread safety: a pass runs in one thread; several passes must not run at once.
class VANTAGE_API MapPasses {
 public:
  virtual ~MapPasses();

  [[nodiscard]] virtual Bounds3 bounds() const noexcept = 0;  ///< the tightest box [m]
  [[nodiscard]] virtual std::uint64_t points() const noexcept = 0;

  /// Shows each point once, in an order that is the same in every pass. How the points are divided
  /// into parts must not matter to the visitor.
  /// Errors: those of the visitor; `io_failure` and `corrupt_data` of the map.
  [[nodiscard]] virtual Result<void> pass(MapVisitor& visitor) const noexcept = 0;

  /// Shows each point of an area once, and maybe others, in the order of `pass`. A map in tiles
  /// reads only the tiles that touch the area.
  /// Errors: those of `pass`, which is what the default does.
  [[nodiscard]] virtual Result<void> pass_over(const Bounds2& area,
                                               MapVisitor& visitor) const noexcept;

  /// All points at once [m], which live as long as the map does.
  /// Errors: `unsupported` (the default) from a map of which only a part is in memory at a time.
  [[nodiscard]] virtual Result<PointsView> in_memory() const noexcept;
};

}  // namespace vantage
