#include "io/map_projection.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "files.hpp"

// What is expected comes from the tools of package geographiclib-tools: the command is beside each.

namespace vantage {
namespace {

using io::GeoPosition;
using io::MapProjection;
using test::check_clear;

constexpr const char* kProjectorFile = "map_projector_info.yaml";
constexpr GeoPosition kTower{.latitude = 35.6586, .longitude = 139.7454, .altitude = 50.0};
const std::string kWgs84 = "vertical_datum: WGS84\n";
const std::string kMapOrigin = "map_origin:\n  latitude: 35.6762\n  longitude: 139.6503\n";

MapProjection projection_of(const std::string& yaml) {
  auto parsed = MapProjection::parse(yaml, kProjectorFile);
  REQUIRE_MESSAGE(parsed, to_string(parsed.error()));
  return *std::move(parsed);
}

void check_place(const std::string& yaml, const GeoPosition& position, const Point& expected) {
  CAPTURE(yaml);
  const auto point = projection_of(yaml).project(position);
  REQUIRE_MESSAGE(point, to_string(point.error()));
  CAPTURE(point->transpose());
  CHECK((*point - expected).cwiseAbs().maxCoeff() < 2e-6);
}

/// Where GeographicLib looks for the grids of geoids, for as long as the object lives.
class GeoidFolder {
 public:
  explicit GeoidFolder(const std::filesystem::path& folder) {
    setenv("GEOGRAPHICLIB_GEOID_PATH", folder.c_str(), 1);
  }
  ~GeoidFolder() { unsetenv("GEOGRAPHICLIB_GEOID_PATH"); }
  GeoidFolder(const GeoidFolder&) = delete;
  GeoidFolder& operator=(const GeoidFolder&) = delete;
};

/// A geoid that is 36.5 m above the ellipsoid everywhere.
std::string even_geoid() {
  std::string grid =
      "P5\n# Offset -100\n# Scale 0.01\n# Origin 90N 0E\n# AREA_OR_POINT Point\n"
      "# Vertical_Datum WGS84\n4 3\n65535\n";
  for (int i = 0; i < 12; ++i) grid += {static_cast<char>(13650 / 256), 13650 % 256};
  return grid;
}

TEST_CASE("MGRS: from the corner of the square, also beyond it") {
  const std::string tokyo = "projector_type: MGRS\nmgrs_grid: 54SUE\n" + kWgs84;
  // echo 35.6586 139.7454 | GeoConvert -u -p 6; GeoConvert -n -u --input-string 54SUE
  check_place(tokyo, kTower, {86437.602781, 46808.155174, 50.0});
  // echo 36.1 138.7 | GeoConvert -u -p 6: in the square 54STE, west of it
  check_place(tokyo, {36.1, 138.7, -3.0}, {-7048.658457, 97489.315447, -3.0});
  // echo -33.8568 151.2153 | GeoConvert -u -p 6; GeoConvert -n -u --input-string 56HLH
  check_place("projector_type: MGRS\nmgrs_grid: 56HLH\n" + kWgs84, {-33.8568, 151.2153, 1.0},
              {34900.569652, 52288.752888, 1.0});
  // echo -0.01 139.7454 | GeoConvert -z 54n -u -p 6: over the equator, without a jump of 10,000 km
  check_place("projector_type: MGRS\nmgrs_grid: 54NUF\n" + kWgs84, {-0.01, 139.7454, 0.0},
              {60383.200774, -1105.567283, 0.0});
}

TEST_CASE("LocalCartesianUTM: from the origin, in its zone") {
  // echo 35.6586 139.7454 | GeoConvert -u -p 6; echo 35.6762 139.6503 | GeoConvert -u -p 6
  check_place("projector_type: LocalCartesianUTM\n" + kWgs84 + kMapOrigin, kTower,
              {8581.826829, -2066.236988, 50.0});
  // echo 35.68 137.99 | GeoConvert -z 54n -u -p 6; echo 35.68 138.01 | GeoConvert -u -p 6
  check_place("projector_type: LocalCartesianUTM\n" + kWgs84 +
                  "map_origin: {latitude: 35.68, longitude: 138.01, altitude: 0.0}\n",
              {35.68, 137.99, 2.0}, {-1810.605664, 55.345667, 2.0});
  // Zone 32 is wider in Norway. echo 60.5 5.4 | GeoConvert -u -p 6; echo 60.4 5.3 | ...
  check_place("projector_type: LocalCartesianUTM\n" + kWgs84 +
                  "map_origin: {latitude: 60.4, longitude: 5.3}\n",
              {60.5, 5.4, 0.0}, {6113.519357, 10820.918418, 0.0});
}

TEST_CASE("TransverseMercator: through the origin") {
  const std::string yaml = "projector_type: TransverseMercator\n" + kWgs84 + kMapOrigin;
  // echo 35.6586 139.7454 | TransverseMercatorProj -l 139.6503 -k 0.9996 -p 9;
  // echo 35.6762 139.6503 | TransverseMercatorProj -l 139.6503 -k 0.9996 -p 9
  check_place(yaml, kTower, {8607.928130, -1947.824517, 50.0});
  // The same with -k 1
  check_place(yaml + "scale_factor: 1.0\n", kTower, {8611.372679, -1948.603958, 50.0});
}

TEST_CASE("LocalCartesian: east, north and up at the origin") {
  // echo 35.6586 139.7454 50 | CartConvert -l 35.6762 139.6503 0 -p 6
  check_place("projector_type: LocalCartesian\n" + kWgs84 + kMapOrigin, kTower,
              {8611.434877, -1948.617474, 43.894652});
}

TEST_CASE("heights above the geoid of EGM2008") {
  const test::TemporaryFolder folder;
  const GeoidFolder geoids(folder.path());
  const std::string yaml = "projector_type: MGRS\nmgrs_grid: 54SUE\nvertical_datum: EGM2008\n";
  SUBCASE("are unknown without its grid") {
    const auto without = projection_of(yaml);
    CHECK(without.unknown_heights().find("geographiclib-get-geoids egm2008-1") !=
          std::string::npos);
    CHECK(without.project(kTower).value().z() == 50.0);
  }
  SUBCASE("are those of its grid") {
    for (const char* name : {"egm2008-5.pgm", "egm2008-1.pgm"}) {
      const auto file = test::put(folder.path() / name, even_geoid());
      const auto with = projection_of(yaml);
      CHECK(with.unknown_heights().empty());
      CHECK(with.project(kTower).value().z() == doctest::Approx(13.5).epsilon(1e-9));
      std::filesystem::remove(file);
    }
  }
  SUBCASE("do not matter to WGS84") {
    test::put(folder.path() / "egm2008-1.pgm", even_geoid());
    const auto ellipsoid = projection_of("projector_type: MGRS\nmgrs_grid: 54SUE\n" + kWgs84);
    CHECK(ellipsoid.unknown_heights().empty());
    CHECK(ellipsoid.project(kTower).value().z() == 50.0);
  }
}

TEST_CASE("heights are unknown where releases of Autoware disagree: an origin with an altitude") {
  const auto made = projection_of("projector_type: TransverseMercator\n" + kWgs84 + kMapOrigin +
                                  "  altitude: 35.5\n");
  CHECK(made.unknown_heights().find("map_origin.altitude is 35.5 m") != std::string::npos);
  CHECK(made.project(kTower).value().z() == 50.0);
}

TEST_CASE("keys that are not needed are ignored") {
  check_place(
      "# by hand\nprojector_type: MGRS\r\nmgrs_grid: '54SUE'\r\nvertical_datum: WGS84\n"
      "map_origin:\n  latitude: 0.0\n  orientation: {x: [1, 2]}\nscale_factor: no\n"
      "more: [[1], {a: b}]\n",
      kTower, {86437.602781, 46808.155174, 50.0});
}

TEST_CASE("positions that have no place in the map") {
  const auto made = projection_of("projector_type: MGRS\nmgrs_grid: 54SUE\n" + kWgs84);
  const auto refused_projector = [&](const GeoPosition& position, const std::string& expected) {
    const auto point = made.project(position);
    REQUIRE_FALSE(point);
    CHECK(point.error().code == ErrorCode::invalid_input);
    CHECK(point.error().message.find(expected) != std::string::npos);
  };
  refused_projector({91.0, 139.0, 0.0}, "is not on the earth");
  refused_projector({35.0, 1e9, 0.0}, "is not on the earth");
  refused_projector({std::nan(""), 139.0, 0.0}, "is not on the earth");
  refused_projector({35.0, 139.0, std::nan("")}, "is not on the earth");
  refused_projector({0.0, 0.0, 0.0},
                    "more than 30 degrees from the meridian of the map's projection, 141 deg");
  CHECK(made.project({35.0, 139.0 - 360.0, 0.0}));
}

void refused_projector(const std::string& yaml, const std::string& expected) {
  CAPTURE(yaml);
  const auto parsed = MapProjection::parse(yaml, kProjectorFile);
  REQUIRE_FALSE(parsed);
  check_clear(parsed.error(), ErrorCode::corrupt_data, kProjectorFile, expected);
}

TEST_CASE("map_projector_info.yaml: malformed") {
  refused_projector("", "expected a mapping with a projector_type");
  refused_projector("- a\n", "expected a mapping with a projector_type, found a list");
  refused_projector("a: [1\n", "is no YAML");
  refused_projector(kWgs84,
                    ":1: error: there is no projector_type, expected MGRS, LocalCartesianUTM");
  refused_projector("projector_type: UTM\n",
                    ":1: error: projector_type must be MGRS, LocalCartesianUTM, "
                    "TransverseMercator or LocalCartesian, found 'UTM'");
  refused_projector("projector_type: [MGRS]\n", "found 'a list'");
  refused_projector("projector_type: MGRS\nprojector_type: MGRS\n",
                    ":2: error: 'projector_type' occurs twice");
  refused_projector("projector_type: MGRS\n", "there is no mgrs_grid, expected a square of 100 km");
  for (const char* grid : {"54SXX", "54", "54S", "54SUE12", "54SUE1234512345", "ZAB", "", "INVALID",
                           "99SUE", "54SUEE"}) {
    refused_projector("projector_type: MGRS\nmgrs_grid: '" + std::string(grid) + "'\n",
                      ":2: error: mgrs_grid must be a square of 100 km such as 54SUE, found");
  }
  refused_projector("projector_type: MGRS\nmgrs_grid: 54SUE\n",
                    "there is no vertical_datum, expected WGS84");
  refused_projector("projector_type: MGRS\nmgrs_grid: 54SUE\nvertical_datum: EGM96\n",
                    ":3: error: vertical_datum must be WGS84 or EGM2008, found 'EGM96'");
  const std::string utm = "projector_type: LocalCartesianUTM\n";
  refused_projector(utm, "there is no map_origin.latitude, expected degrees from -90 to 90");
  refused_projector(utm + "map_origin: here\n", "there is no map_origin.latitude");
  refused_projector(utm + "map_origin:\n  latitude: 35\n", "there is no map_origin.longitude");
  refused_projector(utm + "map_origin:\n  latitude: north\n",
                    ":3: error: map_origin.latitude must be degrees from -90 to 90, found 'north'");
  refused_projector(utm + "map_origin:\n  latitude: 135\n", "found '135'");
  refused_projector(utm + "map_origin:\n  latitude: nan\n", "found 'nan'");
  refused_projector(utm + "map_origin:\n  latitude: 35\n  longitude: 200\n", ":4: error:");
  refused_projector(utm + "map_origin:\n  latitude: 35\n  longitude: 139\n  altitude: high\n",
                    ":5: error: map_origin.altitude must be metres, found 'high'");
  refused_projector(utm + "map_origin: {latitude: 89, longitude: 0}\n",
                    "map_origin.latitude is 89, where UTM has no zones");
  for (const char* scale : {"0", "-1", "nan", "inf", "big"}) {
    refused_projector("projector_type: TransverseMercator\nscale_factor: " + std::string(scale) +
                          "\n" + kMapOrigin,
                      ":2: error: scale_factor must be a number from 0.5 to 2");
  }
  for (const char* local : {"local", "Local"}) {
    const auto parsed =
        MapProjection::parse("projector_type: " + std::string(local) + "\n", kProjectorFile);
    REQUIRE_FALSE(parsed);
    check_clear(parsed.error(), ErrorCode::invalid_input, kProjectorFile,
                ":1: error: the map has no georeference (projector_type " + std::string(local));
  }
  const auto missing = MapProjection::read("nowhere/map_projector_info.yaml");
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == ErrorCode::not_found);
}

TEST_CASE("map_projector_info.yaml: flipped bits do no harm") {
  std::mt19937 random(4);
  const std::string whole = "projector_type: TransverseMercator\n" + kWgs84 + kMapOrigin;
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = whole.substr(0, random() % (whole.size() + 1));
    if (!damaged.empty())
      damaged[random() % damaged.size()] ^= static_cast<char>(1U << random() % 8);
    const auto parsed = MapProjection::parse(damaged, kProjectorFile);
    if (!parsed) {
      CHECK(to_string(parsed.error()).size() < 400);
      continue;
    }
    const auto point = parsed->project(kTower);
    if (point) CHECK(point->allFinite());
  }
}

TEST_CASE("a map's projection is beside its files, or in its folder") {
  const test::TemporaryFolder folder;
  const auto map = folder.path() / "map", tiles = map / "pointcloud_map.pcd";
  std::filesystem::create_directories(tiles);
  using Files = std::vector<std::filesystem::path>;
  const auto beside = [](const Files& patterns) { return io::projector_files_beside(patterns); };
  CHECK(beside({map / "a.pcd", map / "b*.pcd"}) == Files{map / kProjectorFile});
  CHECK(beside({tiles}) == Files{tiles / kProjectorFile, map / kProjectorFile});
  CHECK(beside({tiles / ""}) == Files{tiles / kProjectorFile, map / kProjectorFile});
  CHECK(beside({"a.pcd"}) == Files{kProjectorFile});
  CHECK(beside({}).empty());
}

}  // namespace
}  // namespace vantage
