#include "io/map_projection.hpp"

#include <fmt/format.h>

#include <GeographicLib/Constants.hpp>
#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/Geoid.hpp>
#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/MGRS.hpp>
#include <GeographicLib/TransverseMercator.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <system_error>
#include <utility>

#include "io/text.hpp"
#include "io/yaml_events.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;

constexpr double kUtmScale = 0.9996;
constexpr double kFalseEasting = 500e3;      // of UTM [m]
constexpr double kFalseNorthing = 10'000e3;  // of UTM, south of the equator [m]
constexpr double kFarthestLongitude = 30.0;  // from the central meridian [deg]

GeographicLib::TransverseMercator mercator(double scale) {
  return {GeographicLib::Constants::WGS84_a(), GeographicLib::Constants::WGS84_f(), scale};
}

double central_meridian_of(int utm_zone) { return 6.0 * utm_zone - 183.0; }

/// The finest grid of EGM2008's geoid that is installed; null if there is none.
std::shared_ptr<const GeographicLib::Geoid> open_egm2008() {
  for (const char* name : {"egm2008-1", "egm2008-2_5", "egm2008-5"}) {
    try {
      return std::make_shared<const GeographicLib::Geoid>(name);
    } catch (const std::exception&) {  // the file is missing or none of this library's
    }
  }
  return nullptr;
}

}  // namespace

/// Reads map_projector_info.yaml.
class MapProjectorReader {
 public:
  MapProjectorReader(std::string_view yaml, const std::string& file)
      : file_(file), events_(yaml, file) {}

  [[nodiscard]] Result<MapProjection> read() {
    constexpr std::string_view kDocument = "a mapping with a projector_type";
    VANTAGE_CHECK(events_.next(YAML_STREAM_START_EVENT, kDocument));
    VANTAGE_CHECK(events_.next(YAML_DOCUMENT_START_EVENT, kDocument));
    VANTAGE_TRY(const YamlEvent start, events_.next(YAML_MAPPING_START_EVENT, kDocument));
    line_ = start.line;
    VANTAGE_CHECK(read_mapping(""));
    VANTAGE_CHECK(events_.next(YAML_DOCUMENT_END_EVENT, "the end of the document"));
    VANTAGE_CHECK(events_.next(YAML_STREAM_END_EVENT, "the end of the only document"));
    return projection();
  }

 private:
  struct Value {
    std::string text;
    std::uint32_t line = 0;
  };

  /// The scalars of a mapping that has begun, and of map_origin in it.
  [[nodiscard]] Result<void> read_mapping(const std::string& prefix) {
    while (true) {
      VANTAGE_TRY(const YamlEvent key, events_.next());
      if (key.type == YAML_MAPPING_END_EVENT) return {};
      if (key.type != YAML_SCALAR_EVENT) {
        return events_.error(key.line, fmt::format("expected a key, found {}", described(key)));
      }
      const std::string name = prefix + key.text;
      VANTAGE_TRY(const YamlEvent value, events_.next());
      if (!seen_.insert({name, {value.text, value.line}}).second) {
        return events_.error(key.line,
                             fmt::format("{} occurs twice", quoted(std::string_view(name))));
      }
      if (value.type == YAML_MAPPING_START_EVENT && name == kOrigin) {
        VANTAGE_CHECK(read_mapping(name + "."));
      } else if (value.type != YAML_SCALAR_EVENT) {
        seen_[name].text = described(value);
        VANTAGE_CHECK(events_.skip(value));
      }
    }
  }

  [[nodiscard]] Result<Value> value(const std::string& key, std::string_view expected) const {
    const auto found = seen_.find(key);
    if (found != seen_.end()) return found->second;
    return events_.error(line_, fmt::format("there is no {}, expected {}", key, expected));
  }

  [[nodiscard]] Result<double> number(const std::string& key, double low, double high,
                                      std::string_view expected) const {
    VANTAGE_TRY(const Value found, value(key, expected));
    const auto number = parse_number<double>(found.text);
    if (number && *number >= low && *number <= high) return *number;
    return events_.error(found.line, fmt::format("{} must be {}, found {}", key, expected,
                                                 quoted(std::string_view(found.text))));
  }

  [[nodiscard]] Result<MapProjection> projection() {
    constexpr std::string_view kTypes =
        "MGRS, LocalCartesianUTM, TransverseMercator or LocalCartesian";
    VANTAGE_TRY(const Value type, value("projector_type", kTypes));
    if (type.text == "Local" || type.text == "local") {
      return fail(ErrorCode::invalid_input,
                  fmt::format("the map has no georeference (projector_type {}), so latitudes and "
                              "longitudes have no place in it; expected {}",
                              type.text, kTypes),
                  SourceLocation{file_, type.line, 0});
    }
    if (type.text == "MGRS") {
      VANTAGE_CHECK(set_mgrs());
    } else if (type.text == "LocalCartesianUTM") {
      VANTAGE_CHECK(set_utm());
    } else if (type.text == "TransverseMercator") {
      VANTAGE_CHECK(set_transverse_mercator());
    } else if (type.text == "LocalCartesian") {
      VANTAGE_TRY(const auto origin, origin_of_map());
      made_.plane_ = TangentPlane{origin.latitude, origin.longitude};
    } else {
      return events_.error(type.line, fmt::format("projector_type must be {}, found {}", kTypes,
                                                  quoted(std::string_view(type.text))));
    }
    VANTAGE_CHECK(set_heights());
    return std::move(made_);
  }

  [[nodiscard]] Result<void> set_mgrs() {
    VANTAGE_TRY(const Value grid, value("mgrs_grid", kSquare));
    int zone = 0, precision = -1;
    bool north = true;
    double easting = 0.0, northing = 0.0;
    try {
      GeographicLib::MGRS::Reverse(grid.text, zone, north, easting, northing, precision, false);
    } catch (const std::exception&) {  // precision stays -1
    }
    if (precision != 0 || zone < 1) {
      return events_.error(grid.line, fmt::format("mgrs_grid must be {}, found {}", kSquare,
                                                  quoted(std::string_view(grid.text))));
    }
    made_.plane_ = MercatorPlane{.central_meridian = central_meridian_of(zone),
                                 .scale = kUtmScale,
                                 .x = easting - kFalseEasting,
                                 .y = northing - (north ? 0.0 : kFalseNorthing)};
    return {};
  }

  [[nodiscard]] Result<void> set_utm() {
    VANTAGE_TRY(const auto origin, origin_of_map());
    const int zone = GeographicLib::UTMUPS::StandardZone(origin.latitude, origin.longitude);
    if (zone < 1) {
      return events_.error(line_, fmt::format("map_origin.latitude is {}, where UTM has no zones, "
                                              "expected -80 to 84 degrees",
                                              origin.latitude));
    }
    set_from(origin, central_meridian_of(zone), kUtmScale);
    return {};
  }

  [[nodiscard]] Result<void> set_transverse_mercator() {
    VANTAGE_TRY(const auto origin, origin_of_map());
    double scale = kUtmScale;
    if (seen_.contains("scale_factor")) {
      VANTAGE_TRY(scale, number("scale_factor", 0.5, 2.0, "a number from 0.5 to 2"));
    }
    set_from(origin, origin.longitude, scale);
    return {};
  }

  void set_from(const GeoPosition& origin, double central_meridian, double scale) {
    MercatorPlane plane{.central_meridian = central_meridian, .scale = scale};
    mercator(scale).Forward(central_meridian, origin.latitude, origin.longitude, plane.x, plane.y);
    made_.plane_ = plane;
  }

  [[nodiscard]] Result<GeoPosition> origin_of_map() {
    GeoPosition origin;
    VANTAGE_TRY(origin.latitude,
                number("map_origin.latitude", -90.0, 90.0, "degrees from -90 to 90"));
    VANTAGE_TRY(origin.longitude,
                number("map_origin.longitude", -180.0, 180.0, "degrees from -180 to 180"));
    if (seen_.contains("map_origin.altitude")) {
      VANTAGE_TRY(origin.altitude, number("map_origin.altitude", -1e5, 1e5, "metres"));
    }
    if (origin.altitude != 0.0) {
      made_.unknown_heights_ = fmt::format(
          "heights are not used: map_origin.altitude is {} m, which some releases of Autoware "
          "subtract from heights and others ignore; remove it if the map's heights include it",
          origin.altitude);
    }
    return origin;
  }

  [[nodiscard]] Result<void> set_heights() {
    constexpr std::string_view kData = "WGS84 or EGM2008";
    VANTAGE_TRY(const Value datum, value("vertical_datum", kData));
    if (datum.text == "WGS84") return {};
    if (datum.text != "EGM2008") {
      return events_.error(datum.line, fmt::format("vertical_datum must be {}, found {}", kData,
                                                   quoted(std::string_view(datum.text))));
    }
    made_.geoid_ = open_egm2008();
    if (made_.geoid_ == nullptr && made_.unknown_heights_.empty()) {
      made_.unknown_heights_ =
          "heights are not used: the map's are above the geoid of EGM2008, whose grid is not "
          "installed (geographiclib-get-geoids egm2008-1, of package geographiclib-tools)";
    }
    return {};
  }

  static constexpr const char* kOrigin = "map_origin";
  static constexpr std::string_view kSquare = "a square of 100 km such as 54SUE";

  const std::string& file_;
  YamlEventReader events_;
  std::map<std::string, Value> seen_;
  std::uint32_t line_ = 0;  // at which the mapping begins
  MapProjection made_;
};

Result<MapProjection> MapProjection::parse(std::string_view yaml, const std::string& file) {
  return MapProjectorReader(yaml, file).read();
}

Result<MapProjection> MapProjection::read(const fs::path& file) {
  VANTAGE_TRY(const auto content, read_file(file, "the projection of a map (YAML)"));
  return parse(content.view(), file.string());
}

Result<Point> MapProjection::project(const GeoPosition& position) const {
  const auto& [latitude, longitude, altitude] = position;
  const auto error = [&](ErrorCode code, std::string_view problem) {
    return fail(code, fmt::format("the position {} deg north, {} deg east, {} m up {}", latitude,
                                  longitude, altitude, problem));
  };
  if (!(std::abs(latitude) <= 90.0) || !(std::abs(longitude) <= 360.0) ||
      !std::isfinite(altitude)) {
    return error(ErrorCode::invalid_input, "is not on the earth");
  }
  Point point(0.0, 0.0, altitude);
  if (const auto* plane = std::get_if<MercatorPlane>(&plane_)) {
    // Beyond that, the series of the projection is not accurate.
    if (std::abs(std::remainder(longitude - plane->central_meridian, 360.0)) > kFarthestLongitude) {
      return error(ErrorCode::invalid_input,
                   fmt::format("is more than {} degrees from the meridian of the map's "
                               "projection, {} deg east",
                               kFarthestLongitude, plane->central_meridian));
    }
    mercator(plane->scale)
        .Forward(plane->central_meridian, latitude, longitude, point.x(), point.y());
    point.x() -= plane->x;
    point.y() -= plane->y;
  } else {
    const auto& origin = std::get<TangentPlane>(plane_);
    GeographicLib::LocalCartesian(origin.latitude, origin.longitude)
        .Forward(latitude, longitude, altitude, point.x(), point.y(), point.z());
  }
  if (geoid_ == nullptr) return point;
  try {
    point.z() -= (*geoid_)(latitude, longitude);
  } catch (const std::exception& problem) {
    return error(ErrorCode::io_failure,
                 fmt::format("has no height in the geoid's grid: {}", problem.what()));
  }
  return point;
}

std::vector<fs::path> projector_files_beside(std::span<const fs::path> map_files) {
  std::vector<fs::path> files;
  const auto add = [&](const fs::path& folder) {
    fs::path file = folder / kMapProjectorInfo;
    if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(file);
  };
  for (const fs::path& pattern : map_files) {
    std::error_code ignored;
    const fs::path whole = pattern.has_filename() ? pattern : pattern.parent_path();
    if (fs::is_directory(whole, ignored)) add(whole);
    add(whole.parent_path());
  }
  return files;
}

}  // namespace vantage::io
