#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace GeographicLib {  // NOLINT(readability-identifier-naming)
class Geoid;
}

namespace vantage::io {

/// Autoware's name for the file that says how a map lies on the earth.
inline constexpr const char* kMapProjectorInfo = "map_projector_info.yaml";

/// A position on WGS 84.
struct GeoPosition {
  double latitude = 0.0, longitude = 0.0;  ///< [deg]
  double altitude = 0.0;                   ///< above the ellipsoid [m]
};

/// A transverse Mercator projection with an origin.
struct MercatorPlane {
  double central_meridian = 0.0;  ///< [deg]
  double scale = 0.9996;          ///< on the central meridian
  double x = 0.0, y = 0.0;        ///< the origin, from the central meridian and the equator [m]
};
/// East, north and up at a place on the ellipsoid.
struct TangentPlane {
  double latitude = 0.0, longitude = 0.0;  ///< [deg]
};

/// From latitude, longitude and altitude to the frame of a map, as the content of Autoware's
/// map_projector_info.yaml says (Autoware, map_projection_loader):
/// - MGRS: UTM, from the lower left corner of the square of 100 km `mgrs_grid`, also beyond it
/// - LocalCartesianUTM: UTM in the zone of `map_origin`, from `map_origin`
/// - TransverseMercator: central meridian through `map_origin`, from `map_origin`; `scale_factor`,
///   by default 0.9996
/// - LocalCartesian: east, north and up at `map_origin`
/// Heights are above the ellipsoid (`vertical_datum: WGS84`) or above the geoid of EGM2008.
class MapProjection {
 public:
  /// Keys that are not needed are ignored, as Autoware does.
  /// @param file  for errors
  /// Errors (`where` is the line): `corrupt_data` for text that is not YAML or not such a mapping;
  /// `invalid_input` for a map without a georeference (projector_type Local).
  [[nodiscard]] static Result<MapProjection> parse(std::string_view yaml, const std::string& file);
  /// Errors: those of parse; `not_found`, `io_failure`.
  [[nodiscard]] static Result<MapProjection> read(const std::filesystem::path& file);

  /// The point in the frame of the map [m]. If heights are unknown, z is the altitude.
  /// Errors: `invalid_input` for a position that is not on the earth or too far from the map for
  /// its projection; `io_failure` for a grid of heights that cannot be read.
  [[nodiscard]] Result<Point> project(const GeoPosition& position) const;

  /// A sentence that says why z is not a height in the map; empty if it is one.
  [[nodiscard]] const std::string& unknown_heights() const noexcept { return unknown_heights_; }

 private:
  friend class MapProjectorReader;

  std::variant<MercatorPlane, TangentPlane> plane_;
  std::shared_ptr<const GeographicLib::Geoid> geoid_;  // null: heights above the ellipsoid
  std::string unknown_heights_;
};

/// The files beside a map in which its projection is looked for, each once.
/// @param map_files  as io::map_files takes them: files, folders, patterns
[[nodiscard]] std::vector<std::filesystem::path> projector_files_beside(
    std::span<const std::filesystem::path> map_files);

}  // namespace vantage::io
