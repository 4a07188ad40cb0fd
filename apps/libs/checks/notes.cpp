#include "checks/notes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "evaluation/degrees.hpp"
#include "terminal/counts.hpp"

namespace vantage::checks {
namespace {

constexpr double kShortestRange = 5.0;  // of a LiDAR [m]

/// A length, and what it is about if it is in metres.
struct Length {
  double seen, typical;
};
struct Unit {
  std::string_view name;
  double metres;
};
/// How far lengths in this unit are from what is typical.
double distance_from_typical(const Unit& unit, std::initializer_list<Length> lengths) {
  double off = 0.0;
  for (const Length& length : lengths) {
    off += std::abs(std::log(length.seen * unit.metres / length.typical));
  }
  return off;
}
/// The unit in which lengths seem to be that are not in metres.
Unit unit_of(std::initializer_list<Length> lengths) {
  constexpr std::array kUnits{Unit{"centimetres", 0.01}, Unit{"millimetres", 0.001},
                              Unit{"kilometres", 1000.0}};
  return *std::min_element(kUnits.begin(), kUnits.end(), [&](const Unit& a, const Unit& b) {
    return distance_from_typical(a, lengths) < distance_from_typical(b, lengths);
  });
}

/// Of a map whose points lie closer or farther apart than those of maps in metres usually do.
std::string advice_on_spacing(double spacing, const Eigen::Vector3d& extent) {
  constexpr double kTypical = 0.1, kHeight = 15.0;  // of a map from its lowest to its highest point
  constexpr double kNarrowest = 10.0;               // of a map that a sensor is localized in [m]
  const Length apart{spacing, kTypical}, height{std::max(extent.minCoeff(), spacing), kHeight};
  const Unit unit = unit_of({apart, height}), metre{"metres", 1.0};
  const bool sparse = spacing > kTypical && (distance_from_typical(metre, {apart, height}) <
                                                 distance_from_typical(unit, {apart, height}) ||
                                             unit.metres * extent.maxCoeff() < kNarrowest);
  if (!sparse) return fmt::format("maps are in metres; this one seems to be in {}", unit.name);
  // `vantage init` chooses voxels of 2 m at most; larger ones smooth away what a pose depends on.
  return "it has too few points for the matcher, which needs six in a voxel of 2 m: give a denser "
         "map";
}

/// "1,234" for large numbers, and three digits for small ones.
std::string metres(double value) {
  if (std::abs(value) >= 1000.0) return cli::grouped_whole(std::abs(value)) + " m";
  return fmt::format("{:.3g} m", value);
}

const double* number_in(const Table& params, std::string_view key) {
  const Value* const value = params.find(key);
  return value == nullptr ? nullptr : std::get_if<double>(&value->data);
}

constexpr double kGround = 0.4, kNoGround = 0.25;  // shares of square metres

double share_of(const std::optional<GroundPlane>& plane) { return plane ? plane->share : 0.0; }
bool shows(const std::optional<GroundPlane>& plane) { return share_of(plane) > kGround; }

/// What the elevations of the scans' points say against those that a selector takes for visible.
std::optional<Note> note_on_elevations(const ScanFacts& scans, const SelectorConfig& selector) {
  // On the recorded street (HDL-64, -24.8 to 2 degrees), a hundredth of the points lies below -21.5
  // and a thousandth below -23.6; a hundredth lies above 2.6 and a thousandth above 3.4.
  constexpr double kOutside = 3.0, kEmpty = 5.0;  // [deg]
  // Under open sky, and where the ground was removed, points end before the rays do. If it is the
  // rays that end, many points lie near the end.
  constexpr double kManyAbove = 0.1, kNearTop = 0.05, kAtOnce = 4.0;  // shares; [deg]
  if (scans.elevations.empty()) return std::nullopt;
  const auto at = [&](double share) { return scans.elevation_at(share) * kDegrees; };
  const double bottom = at(0.001), top = at(0.999);
  const bool outside =
      at(0.01) < selector.lowest - kOutside || at(0.99) > selector.highest + kOutside;
  const bool empty_below = bottom > selector.lowest + kEmpty && shows(scans.below);
  const bool empty_above = top < selector.highest - kEmpty && at(1.0 - kManyAbove) > 0.0 &&
                           top - at(1.0 - kNearTop) < kAtOnce;
  if (!outside && !empty_below && !empty_above) return std::nullopt;
  return Note{fmt::format("selector.lowest is {:g} degrees and highest {:g}, and the scans' points "
                          "lie between {:.1f} and {:.1f}",
                          selector.lowest, selector.highest, bottom, top),
              "give the elevations of the sensor's lowest and highest rays"};
}

}  // namespace

std::vector<Note> notes_on_damage(std::span<const Error> damaged) {
  std::vector<Note> notes;
  for (const Error& error : damaged) {
    const std::string file = error.where ? error.where->file + ": " : std::string();
    notes.push_back({file + error.message, "what comes before is used"});
  }
  return notes;
}

Note note_on_stamps(const Error& error) {
  const std::string file = error.where ? error.where->file + ": " : std::string();
  return {file + error.message, "give both with the same clock, in seconds; it would not be used"};
}

std::optional<Note> note_on_reference(double least, double median, double most) {
  constexpr double kFar = 10.0;       // [m]
  constexpr double kConstant = 0.02;  // of the error; a turned frame changes it more
  if (median < kFar) return std::nullopt;
  const bool shifted = most - least < kConstant * median;
  return Note{fmt::format("the poses of tracked scans are {} from the reference in the median, and "
                          "the scans fit the map",
                          metres(median)),
              shifted ? "the reference is shifted by that: give it in the frame of the map"
                      : "the reference is probably in another frame than the map, or its stamps "
                        "are those of another clock than the scans'"};
}

std::vector<Note> notes_on(const MapFacts& map) {
  constexpr double kSparsest = 1.5, kDensest = 0.002;  // spacing of maps that are in metres [m]
  constexpr double kCoarsest = 0.005;                  // rounding that costs no accuracy [m]
  std::vector<Note> notes;
  const Eigen::Vector3d extent = map.bulk.max - map.bulk.min;
  if (map.spacing > kSparsest || (map.spacing > 0.0 && map.spacing < kDensest)) {
    notes.push_back(
        {fmt::format("the map's points lie {} apart, over {} x {} x {}", metres(map.spacing),
                     metres(extent.x()), metres(extent.y()), metres(extent.z())),
         advice_on_spacing(map.spacing, extent)});
    return notes;
  }
  if (map.up && *map.up != Direction{}) {
    notes.push_back(
        {fmt::format("the map's things stand on its ground in direction {}", to_string(*map.up)),
         "z must point up: turn the map (mirror nothing)"});
  }
  if (map.rounding >= kCoarsest) {
    const Point middle = 0.5 * (map.bulk.min + map.bulk.max);
    notes.push_back(
        {fmt::format("the map's coordinates reach {}, where 32-bit floats are {} apart",
                     metres(map.farthest_coordinate), metres(map.rounding)),
         fmt::format("export it again with an origin subtracted, for example ({:.0f}, {:.0f}, 0), "
                     "or as doubles",
                     std::round(middle.x() / 100.0) * 100.0,
                     std::round(middle.y() / 100.0) * 100.0)});
  }
  return notes;
}

std::vector<Note> notes_on(const MapFacts& map, const Config& config) {
  constexpr double kClear = 2.5;  // factor by which spacings must differ
  std::vector<Note> notes = notes_on(map);
  if (!notes.empty()) return notes;  // numbers of the configuration cannot suit such a map
  if (!config.visibility) return notes;
  const double* const spacing = number_in(config.visibility->params, "point_spacing");
  if (spacing != nullptr && map.spacing > 0.0 &&
      std::abs(std::log(*spacing / map.spacing)) > std::log(kClear)) {
    notes.push_back(
        {fmt::format("the map's points lie {} apart, and visibility.params.point_spacing "
                     "is {}",
                     metres(map.spacing), metres(*spacing)),
         fmt::format("set it to {:.2g}", map.spacing)});
  }
  for (Note& note : notes_on_reach(config)) notes.push_back(std::move(note));
  return notes;
}

std::vector<Note> notes_on_reach(const Config& config) {
  const auto range = config.visibility ? config.visibility->max_range : std::nullopt;
  if (!range || *range >= kShortestRange) return {};
  return {{fmt::format("visibility.max_range is {}", metres(*range)),
           "regions lose what the sensor sees farther away: give the reach of the sensor"}};
}

std::vector<Note> notes_on(const ScanFacts& scans, bool imu) {
  constexpr double kFarthest = 400.0, kNearest = 0.5;  // within which 90 % of the points lie [m]
  constexpr double kTypical = 40.0;                    // [m]
  constexpr double kAside = 3.0, kFarAside = 20.0;     // eccentricity; [m]
  constexpr double kFewest = 300.0;                    // points of a scan
  constexpr std::size_t kFewestElsewhere = 2;
  std::vector<Note> notes;
  if (scans.scans == 0) return notes;
  if (scans.ranges.empty()) {
    notes.push_back({fmt::format("{} scans were looked at, and none has a point", scans.scans),
                     "choose another topic, or record again"});
    return notes;
  }
  if (scans.points < kFewest) {
    notes.push_back({fmt::format("a scan has {:.0f} points", scans.points),
                     "give whole sweeps: so few points fit anywhere"});
    return notes;
  }
  const double reach = scans.range_at(0.9);
  if (scans.eccentricity > kAside && scans.range_at(0.5) > kFarAside) {
    notes.push_back({"the points of a scan lie all on one side of the sensor, far away",
                     "they seem to be in the map's frame; give scans in the sensor's frame"});
    return notes;
  }
  if (scans.elsewhere >= kFewestElsewhere && 4 * scans.elsewhere >= scans.placed) {
    notes.push_back(
        {fmt::format("{} of {} scans were not taken from the origin of their points, but up to "
                     "{:.0f} m beside it, as what they see behind other things shows",
                     scans.elsewhere, scans.placed, scans.farthest),
         "they seem to be in the map's frame; give scans in the sensor's frame"});
    return notes;
  }
  if (reach > kFarthest || reach < kNearest) {
    notes.push_back({fmt::format("nine in ten points of the scans are within {}", metres(reach)),
                     fmt::format("scans are in metres; these seem to be in {}",
                                 unit_of({{reach, kTypical}}).name)});
    return notes;
  }
  if (scans.empty > 0) {
    notes.push_back(
        {fmt::format("{} of {} scans that were looked at have no point", scans.empty, scans.scans),
         "the sensor or the driver lost sweeps, or they are cut in pieces"});
  }
  if (shows(scans.above) && share_of(scans.below) < kNoGround && !imu) {
    notes.push_back({"the scans show the ground above the sensor",
                     "the sensor hangs upside down, which --imu would tell, or its z axis points "
                     "down: z must point up"});
  }
  constexpr double kShortestSweep = 1e-4, kLongestSweep = 1.0;  // [s]
  if (scans.timed && (scans.sweep < kShortestSweep || scans.sweep > kLongestSweep)) {
    notes.push_back({fmt::format("the times of a scan's points span {:.3g} s", scans.sweep),
                     "a sweep takes 0.05 to 0.2 s; set localizer.undistort = false, or mend the "
                     "unit of the times"});
  }
  return notes;
}

std::vector<Note> notes_on(const ScanFacts& scans, const Config& config, bool imu) {
  std::vector<Note> notes = notes_on(scans, imu);
  if (!notes.empty() || scans.ranges.empty()) return notes;
  if (config.localizer) {
    const LocalizerParams& params = *config.localizer;
    const double most = params.scan_max_range.value_or(std::numeric_limits<double>::infinity());
    if (const double kept = scans.share_within(params.scan_min_range, most); kept < 0.5) {
      notes.push_back(
          {fmt::format("localizer.scan_min_range and scan_max_range keep {:.1f} % of the points",
                       100.0 * kept),
           fmt::format("half of the points are farther than {}", metres(scans.range_at(0.5)))});
    }
  }
  return notes;
}

std::vector<Note> notes_on_sensor(const ScanFacts& scans, const Config& config, bool imu) {
  std::vector<Note> notes;
  if (scans.ranges.empty() || !notes_on(scans, imu).empty()) return notes;
  const double reach = scans.range_at(0.9), farthest = scans.range_at(0.999);
  constexpr double kCut = 1.0 / 3.0;
  const auto range = config.visibility ? config.visibility->max_range : std::nullopt;
  if (range && *range >= kShortestRange && *range < 0.5 * reach) {
    notes.push_back({fmt::format("visibility.max_range is {}, and a tenth of the scans' points are "
                                 "farther than {}",
                                 metres(*range), metres(reach)),
                     "regions lack what the sensor sees: give the reach of the sensor"});
  }
  if (range && farthest < kCut * *range) {
    notes.push_back({fmt::format("visibility.max_range is {}, and the scans end at {}",
                                 metres(*range), metres(farthest)),
                     "were the scans cut, or is it not in metres? If they are whole, give the "
                     "reach of the sensor"});
  }
  if (config.selector) {
    if (auto note = note_on_elevations(scans, *config.selector)) notes.push_back(*std::move(note));
  }
  if (!shows(scans.below)) return notes;
  const double height = scans.below->distance;
  if (config.viewpoints && config.viewpoints->source == ViewpointSource::ground) {
    const double given = config.viewpoints->sensor_height;
    if (std::abs(height - given) > std::max(0.3, 0.35 * height)) {
      constexpr double kFoot = 0.3048, kHigh = 3.0;  // [m]
      const bool feet = height > kHigh && std::abs(height * kFoot - given) < 0.15 * given;
      notes.push_back(
          {fmt::format("the scans see the ground {} below the sensor, and "
                       "viewpoints.sensor_height is {}",
                       metres(height), metres(given)),
           feet ? std::string("are the scans in feet? If not, give the height that they show")
                : fmt::format("set it to {:.2f}", height)});
    }
  }
  constexpr double kTilted = 10.0;  // [deg]
  const double tilt = scans.below->tilt * kDegrees;
  if (tilt > kTilted && !imu &&
      !(config.localizer && config.localizer->gravity == Gravity::unknown)) {
    notes.push_back({fmt::format("the sensor is tilted by {:.0f} degrees", tilt),
                     "set localizer.gravity = \"unknown\""});
  }
  return notes;
}

}  // namespace vantage::checks
