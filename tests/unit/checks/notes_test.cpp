#include "checks/notes.hpp"

#include <doctest/doctest.h>

#include <string>
#include <utility>
#include <vector>

#include "evaluation/degrees.hpp"

namespace vantage::checks {
namespace {

MapFacts good_map() {
  MapFacts map;
  map.points = 1'000'000;
  map.bulk.extend(Point(0.0, 0.0, 0.0));
  map.bulk.extend(Point(150.0, 120.0, 10.0));
  map.spacing = 0.11;
  map.farthest_coordinate = 150.0;
  map.rounding = 1.5e-5;
  map.up = Direction{};
  return map;
}

ScanFacts good_scans() {
  ScanFacts scans;
  scans.scans = 5;
  scans.points = 20'000.0;
  for (int k = 0; k < 1000; ++k) scans.ranges.push_back(2.0F + 0.06F * static_cast<float>(k));
  scans.below = GroundPlane{.distance = 1.75, .tilt = 0.02, .share = 0.7};
  return scans;
}

Config config() {
  Config config;
  config.viewpoints = ViewpointParams{.sensor_height = 1.73};
  config.visibility = VisibilityConfig{};
  config.visibility->max_range = 60.0;
  config.localizer = LocalizerParams{};
  return config;
}

/// Requires one note at most, and returns its text.
std::string only(const std::vector<Note>& notes) {
  REQUIRE(notes.size() <= 1);
  return notes.empty() ? "" : notes.front().what + ": " + notes.front().advice;
}

TEST_CASE("right inputs give no note") {
  CHECK(notes_on(good_map(), config()).empty());
  CHECK(notes_on(good_scans(), config(), false).empty());
  CHECK(notes_on_sensor(good_scans(), config(), false).empty());
}

TEST_CASE("maps in other units, upside down, rounded") {
  const auto note = [](auto change) {
    MapFacts map = good_map();
    change(map);
    return only(notes_on(map, config()));
  };
  const auto times = [](double factor, double spacing = 0.11) {
    return [factor, spacing](MapFacts& m) {
      m.spacing = factor * spacing;
      m.bulk.min *= factor;
      m.bulk.max *= factor;
    };
  };
  CHECK(note(times(100.0)).ends_with("seems to be in centimetres"));
  CHECK(note(times(1000.0)).ends_with("seems to be in millimetres"));
  CHECK(note(times(0.001)).ends_with("seems to be in kilometres"));
  CHECK(note(times(100.0, 0.4)).ends_with("seems to be in centimetres"));  // a sparse map
  CHECK(note([](MapFacts& m) {
          m.up = Direction{2, true};
        }).find("in direction -z") != std::string::npos);
  CHECK(note([](MapFacts& m) { m.up = std::nullopt; }).empty());
  CHECK(note([](MapFacts& m) {
          m.farthest_coordinate = 5'428'000.0;
          m.rounding = 0.5;
        }).starts_with("the map's coordinates reach 5,428,000 m, where 32-bit floats are 0.5 m"));
  CHECK(note([](MapFacts& m) {
          m.farthest_coordinate = -1e300;
          m.rounding = 1e284;
        }).starts_with("the map's coordinates reach 1e+300 m, where 32-bit floats are 1e+284 m"));
}

TEST_CASE("a sparse map in metres is not taken for one in another unit") {
  const auto note = [](double spacing, const Point& extent) {
    MapFacts map = good_map();
    map.spacing = spacing;
    map.bulk = Bounds3();
    map.bulk.extend(Point(0.0, 0.0, 0.0));
    map.bulk.extend(extent);
    return only(notes_on(map));
  };
  const std::string sparse =
      "it has too few points for the matcher, which needs six in a voxel of 2 m: give a denser map";
  CHECK(note(2.1, {500.0, 300.0, 20.0}) ==
        "the map's points lie 2.1 m apart, over 500 m x 300 m x 20 m: " + sparse);
  // Hills: their height is that of things in centimetres, but no map is 4 m wide.
  CHECK(note(2.1, {400.0, 300.0, 130.0}).ends_with(sparse));
  CHECK(note(12.0, {15'000.0, 9'000.0, 1'500.0}).ends_with("seems to be in centimetres"));
}

TEST_CASE("a configuration that does not suit the map") {
  Config other = config();
  other.visibility->params.entries.push_back({"point_spacing", {0.5, {}}, {}});
  CHECK(only(notes_on(good_map(), other)).ends_with("set it to 0.11"));
  other = config();
  other.visibility->max_range = 1.0;
  CHECK(only(notes_on(good_map(), other)).starts_with("visibility.max_range is 1 m"));
}

TEST_CASE("a reference that tracked scans are far from") {
  CHECK_FALSE(note_on_reference(0.0, 0.02, 3.0));
  CHECK_FALSE(note_on_reference(0.0, 9.0, 3000.0));
  const auto far = note_on_reference(200.0, 3456.0, 9000.0);
  REQUIRE(far);
  CHECK(far->what.starts_with("the poses of tracked scans are 3,456 m from the reference"));
  CHECK(far->advice.find("in another frame than the map, or its stamps") != std::string::npos);
  CHECK(note_on_reference(99.9, 100.0, 100.1)->advice.starts_with("the reference is shifted"));
}

TEST_CASE("scans in other units or another frame, and without points") {
  const auto note = [](auto change) {
    ScanFacts scans = good_scans();
    change(scans);
    return only(notes_on(scans, config(), false));
  };
  const auto times = [](float factor) {
    return [factor](ScanFacts& s) {
      for (float& range : s.ranges) range *= factor;
    };
  };
  CHECK(note(times(1000.0)).ends_with("seem to be in millimetres"));
  CHECK(note(times(100.0)).ends_with("seem to be in centimetres"));
  CHECK(note(times(0.001F)).ends_with("seem to be in kilometres"));
  CHECK(note([](ScanFacts& s) { s.eccentricity = 20.0; }).find("map's frame") != std::string::npos);
  CHECK(note([](ScanFacts& s) {
          s.placed = 10;
          s.elsewhere = 3;
          s.farthest = 22.4;
        }).find("3 of 10 scans were not taken from the origin of their points, but up to 22 m") ==
        0);
  CHECK(note([](ScanFacts& s) { s.ranges.clear(); }).starts_with("5 scans were looked at"));
  CHECK(note([](ScanFacts& s) { s.empty = 2; }).starts_with("2 of 5 scans"));
  CHECK(note([](ScanFacts& s) { s.points = 40.0; }).starts_with("a scan has 40 points"));
}

TEST_CASE("the sensor's height and tilt") {
  const auto note = [](double height, double tilt, bool imu) {
    ScanFacts scans = good_scans();
    scans.below->distance = height;
    scans.below->tilt = tilt;
    return only(notes_on_sensor(scans, config(), imu));
  };
  CHECK(note(0.5, 0.0, false).ends_with("set it to 0.50"));
  CHECK(note(5.7, 0.0, false).find("feet") != std::string::npos);
  CHECK(note(1.9, 0.0, false).empty());
  CHECK(note(1.75, 0.3, false).starts_with("the sensor is tilted by 17 degrees"));
  CHECK(note(1.75, 0.3, true).empty());
}

TEST_CASE("elevations of a selector that are not those of the sensor's rays") {
  const auto note = [](double lowest, double highest, std::vector<double> points,
                       bool ground = true) {
    Config other = config();
    other.selector = SelectorConfig{};
    other.selector->lowest = lowest;
    other.selector->highest = highest;
    ScanFacts scans = good_scans();
    if (!ground) scans.below.reset();
    for (double& elevation : points) elevation /= kDegrees;
    scans.elevations.assign(points.begin(), points.end());
    return only(notes_on_sensor(scans, other, false));
  };
  // As many points at each of 16 rays, and fewer at those from 0 degrees on.
  const auto rays = [](double from, double step, int above) {
    std::vector<double> points;
    for (int k = 0; k < 16; ++k) {
      const double elevation = from + k * step;
      points.insert(points.end(), elevation < 0.0 ? 500 : above, elevation);
    }
    return points;
  };
  const auto vlp16 = rays(-15.0, 2.0, 300), hdl64 = rays(-24.8, 26.8 / 15.0, 500);
  CHECK(note(-15.0, 15.0, vlp16).empty());
  CHECK(note(-24.8, 2.0, hdl64).empty());
  CHECK(note(-17.5, 17.5, vlp16).empty());
  CHECK(
      note(-15.0, 15.0, hdl64) ==
      "selector.lowest is -15 degrees and highest 15, and the scans' points lie between -24.8 and "
      "2.0: give the elevations of the sensor's lowest and highest rays");
  CHECK(!note(-15.0, 10.0, vlp16).empty());
  CHECK(!note(-10.0, 15.0, vlp16).empty());
  CHECK(!note(-15.0, 52.0, vlp16).empty());
  CHECK(!note(-25.0, 15.0, vlp16).empty());
  CHECK(!note(-24.8, 15.0, hdl64).empty());
  // The ground was removed, or there is nothing above the sensor.
  CHECK(note(-25.0, 15.0, vlp16, false).empty());
  CHECK(note(-15.0, 15.0, rays(-15.0, 1.0, 20)).empty());
  CHECK(note(-15.0, 15.0, {}).empty());
}

TEST_CASE("a sensor that hangs upside down needs an IMU") {
  ScanFacts scans = good_scans();
  scans.above = scans.below;
  scans.below->share = 0.1;
  CHECK(only(notes_on(scans, config(), false)).starts_with("the scans show the ground above"));
  CHECK(notes_on(scans, config(), true).empty());
}

TEST_CASE("limits that drop most points") {
  Config other = config();
  other.localizer->scan_max_range = 1.0;
  CHECK(only(notes_on(good_scans(), other, false)).find("keep 0.0 % of the points") !=
        std::string::npos);
  other = config();
  other.visibility->max_range = 20.0;
  CHECK(only(notes_on_sensor(good_scans(), other, false))
            .starts_with("visibility.max_range is 20 m, and a tenth"));
  other.visibility->max_range = 300.0;
  CHECK(only(notes_on_sensor(good_scans(), other, false)).find("the scans end at 61.9 m") !=
        std::string::npos);
}

TEST_CASE("times of points in another unit") {
  ScanFacts scans = good_scans();
  scans.timed = true;
  scans.sweep = 0.1;
  CHECK(notes_on(scans, config(), false).empty());
  scans.sweep = 1e-7;
  CHECK(only(notes_on(scans, config(), false)).starts_with("the times of a scan's points span"));
}

TEST_CASE("notes are kept in a bundle and read again") {
  const std::vector<Note> notes{{"seen \"this\"", "do that"}, {"a", "b"}};
  CHECK(decode(encode(notes)) == notes);
  // Whatever bytes are in their texts.
  CHECK(decode(encode(std::vector<Note>{{"m\xe9tro", "a"}})) ==
        std::vector<Note>{{"m\uFFFDtro", "a"}});
  CHECK(decode(encode({})) == std::vector<Note>());
  for (const std::string_view bad : {"", "{}", "[1]", "[{\"what\":1,\"advice\":\"b\"}]", "[{}]"}) {
    CHECK_FALSE(decode(std::as_bytes(std::span(bad))));
  }
}

}  // namespace
}  // namespace vantage::checks
