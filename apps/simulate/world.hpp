#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "simulate/campus.hpp"
#include "simulate/params.hpp"
#include "simulate/solid.hpp"
#include "simulate/street_grid.hpp"
#include "simulate/terrain.hpp"
#include "vantage/result.hpp"

namespace vantage::simulation {

/// The first place where a ray meets the world.
struct Hit {
  double range;          ///< [m]
  double cos_incidence;  ///< of the angle between ray and surface normal, in [0, 1]
  Surface surface;
};

/// Whether rays are cast in a world; its triangles take most of the memory.
enum class Rays : bool { no, yes };

/// The day on which a world is looked at: `[changes]` lie between the map and the drive.
enum class Day : std::uint8_t { map, drive };

/// The campus as triangles for casting rays. Campus frame: z up, origin at the centre of the
/// campus, half-way between its lowest and highest ground [m]; in the map frame, that origin is
/// `map_origin()`.
/// Thread safety: const methods may run on one object from many threads at once.
class World {
 public:
  /// Streets and terrain are the same on both days.
  /// Errors: `internal` if Embree refuses (its message is passed on); those of `changed`.
  [[nodiscard]] static Result<World> create(const WorldParams& params, Day day = Day::map,
                                            Rays rays = Rays::yes);

  World(World&&) noexcept;
  World& operator=(World&&) noexcept;
  ~World();

  [[nodiscard]] const StreetGrid& streets() const noexcept;
  [[nodiscard]] const Terrain& terrain() const noexcept;
  [[nodiscard]] const Campus& campus() const noexcept;
  [[nodiscard]] const SolidIndex& solids() const noexcept;
  [[nodiscard]] const Point& map_origin() const noexcept;

  /// @param direction  unit vector
  /// @return           nothing if the ray meets nothing within `max_range` [m], or in a world
  ///                   without rays
  [[nodiscard]] std::optional<Hit> cast(const Point& origin, const Eigen::Vector3d& direction,
                                        double max_range) const noexcept;

 private:
  struct Parts;
  explicit World(std::unique_ptr<Parts> parts) noexcept;

  std::unique_ptr<Parts> parts_;
};

}  // namespace vantage::simulation
