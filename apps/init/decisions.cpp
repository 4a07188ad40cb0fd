#include "init/decisions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string_view>
#include <utility>

#include "evaluation/degrees.hpp"
#include "terminal/counts.hpp"
#include "terminal/size.hpp"
#include "vantage/engine/toml.hpp"

namespace vantage::init {
namespace {

// A cell of ndt takes 111 to 124 bytes in memory on the recorded street and two simulated campuses,
// and 39 % more if a guess is far off.
constexpr double kBytesOfCell = 180.0;
// A map that a selector chose takes up to so many times its stored bytes in memory.
constexpr double kUnpacked = 16.0;
// The map in use, the next one, and those of rival poses.
constexpr double kMapsHeld = 4.0;
constexpr std::array kWidths{50.0, 30.0, 20.0};           // of regions [m]
constexpr double kFewestBytes = 10e3, kMostBytes = 80e3;  // of a chosen map: 5,000 are too few

std::string number(double x) {
  std::string text = fmt::format("{:g}", x);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string text(const std::string& value) { return to_toml(Value{value, {}}); }

std::string about(double bytes) { return cli::size_text(static_cast<std::uint64_t>(bytes)); }

/// How regions are made.
struct Cut {
  double width = 0.0;   ///< 0: the map is one region
  double chosen = 0.0;  ///< bytes that a selector leaves of a region; 0: all
  double bytes = 0.0;   ///< that the largest region takes in memory, about
};

/// What a region of a width takes in memory, at most: all cells within reach.
double bytes_of_region(const CellCount& cells, double width, double reach) {
  const double box = (width + 2.0 * reach) * (width + 2.0 * reach);
  const double share = cells.area > 0.0 ? std::min(1.0, box / cells.area) : 1.0;
  return kBytesOfCell * share * static_cast<double>(cells.cells);
}

Result<Cut> cut_for(const Known& known, double reach) {
  const auto memory = static_cast<double>(known.memory);
  Cut cut{.bytes = kBytesOfCell * static_cast<double>(known.cells.cells)};
  if (cut.bytes <= memory) return cut;
  if (!has_ground(known.map) && !known.trajectory) {
    return fail(ErrorCode::invalid_input,
                fmt::format("the map has no ground above which viewpoints could stand ({:.0f} % of "
                            "its ground plan is flat), and as one region it takes about {}, which "
                            "is more than --memory: give --trajectory or more memory",
                            100.0 * known.map.flat_share, about(cut.bytes)));
  }
  for (const double width : kWidths) {
    cut.width = width;
    cut.bytes = bytes_of_region(known.cells, width, reach);
    if (kMapsHeld * cut.bytes <= memory) return cut;
  }
  cut.chosen = std::min(kMostBytes, std::floor(memory / (kMapsHeld * kUnpacked) / 1e3) * 1e3);
  if (cut.chosen >= kFewestBytes) return cut;
  return fail(ErrorCode::invalid_input,
              fmt::format("region maps that are useful take about {} together: --memory is too "
                          "little",
                          about(kMapsHeld * kUnpacked * kFewestBytes)));
}

/// The decisions, as they are made.
class List {
 public:
  void table(std::string name) { table_ = std::move(name); }
  void add(std::string key, std::string value, std::string why) {
    all_.push_back({table_, std::move(key), std::move(value), std::move(why)});
  }
  [[nodiscard]] std::vector<Decision> take() && { return std::move(all_); }

 private:
  std::string table_;
  std::vector<Decision> all_;
};

void decide_regions(List& list, const Known& known, const Cut& cut) {
  list.table("partitioner");
  const std::string cells = cli::grouped(known.cells.cells);
  if (cut.width == 0.0) {
    list.add("plugin", text("whole_map"),
             fmt::format("One region. The matcher's {} cells of the map take about {} of memory, "
                         "which is less than the {} allowed; smaller regions pay off where the map "
                         "does not fit.",
                         cells, about(cut.bytes), about(static_cast<double>(known.memory))));
    return;
  }
  const bool along = !has_ground(known.map);
  list.add("plugin", text(along ? "trajectory" : "uniform_grid"),
           along ? "Regions along the path of the sensor: there is no ground that shows where else "
                   "it may be."
                 : "Square regions: the usual choice.");
  const std::string size = fmt::format(
      "All {} cells of the map take about {}. Of these, up to {} are within reach of a "
      "region of {:g} m",
      cells, about(kBytesOfCell * static_cast<double>(known.cells.cells)), about(cut.bytes),
      cut.width);
  list.add(
      "params",
      fmt::format("{{ {} = {} }}", along ? "segment_length" : "cell_width", number(cut.width)),
      size + (cut.chosen > 0.0
                  ? "; that is too much, see [selector]."
                  : fmt::format(", and {:g} such maps fit into the memory allowed.", kMapsHeld)));
}

struct SeenGround {
  checks::GroundPlane plane;
  std::string_view side;  ///< of the sensor
};
/// The ground that the scans show, below or, of a sensor that hangs upside down, above.
std::optional<SeenGround> ground_in(const Known& known) {
  constexpr double kEnough = 0.25;  // of the square metres around
  if (!known.scans) return std::nullopt;
  const auto &below = known.scans->below, &above = known.scans->above;
  if (below && below->share >= kEnough) return SeenGround{*below, "below"};
  if (known.imu && above && above->share >= kEnough) return SeenGround{*above, "above"};
  return std::nullopt;
}

void decide_viewpoints(List& list, const Known& known) {
  constexpr double kStep = 0.05;          // [m]
  constexpr double kManySquares = 0.5e6;  // [m^2]
  const bool along = !has_ground(known.map) && known.trajectory;
  const std::string flat =
      fmt::format("{:.0f} % of the map's ground plan is flat", 100.0 * known.map.flat_share);
  if (!along) {
    list.table("ground");
    list.add("plugin", text("pmf"),
             has_ground(known.map)
                 ? flat + ": the map has its ground."
                 : "Only " + flat +
                       ": the ground was removed. The filter then takes the lowest "
                       "things for it, which only serves the search for a lost sensor here; a "
                       "--trajectory is better.");
  }
  list.table("viewpoints");
  if (along) {
    list.add("source", text("trajectory"),
             "Only " + flat +
                 ": the ground was removed, so viewpoints stand along the path of the "
                 "sensor.");
  }
  const bool wide = known.cells.area > kManySquares;
  list.add("voxel_size", wide ? "10.0" : "5.0",
           wide ? "The usual distance of 5 m would make the build of a map this large long."
                : "The usual compromise: smaller values take longer and add little.");
  if (along) return;
  if (const auto ground_seen = ground_in(known)) {
    const checks::GroundPlane& plane = ground_seen->plane;
    list.add("sensor_height", number(std::round(plane.distance / kStep) * kStep),
             fmt::format("The scans show the ground about {:.2f} m {} the sensor, on {:.0f} % of "
                         "the square metres around it.",
                         plane.distance, ground_seen->side, 100.0 * plane.share));
  } else {
    list.add("sensor_height", "1.0",
             known.scans ? "YOURS: the scans show too little ground to measure it."
                         : "YOURS: the height of the sensor above the ground; no recording shows "
                           "it.");
  }
}

void decide_visibility(List& list, const Known& known, const Cut& cut, double reach) {
  list.table("visibility");
  if (cut.width == 0.0) {
    list.add("plugin", text("keep_all"), "The one region has the whole map.");
    return;
  }
  list.add("plugin", text("surface"),
           "Keeps what scans will see; such maps localize as well as the whole one.");
  list.add("max_range", number(reach),
           known.scans
               ? fmt::format("All but a thousandth of the scans' points are within {:.0f} m.",
                             known.scans->range_at(0.999))
               : std::string("YOURS: the reach of the sensor; no recording shows it."));
  if (known.map.spacing > 0.0) {
    list.add("params", fmt::format("{{ point_spacing = {:.2g} }}", known.map.spacing),
             "The distance of neighbouring points on the map's surfaces, measured.");
  }
}

void decide_storage(List& list, const Known& known, const Cut& cut) {
  list.table("store");
  list.add("plugin", text("pcd_tiles"), "A folder with a file for each region.");
  list.add("content", text("prepared"),
           "The matcher's cells instead of points: a small part of the bytes, with the accuracy of "
           "all points.");
  list.add("params", fmt::format("{{ root = {} }}", text(known.root)), "The folder of the bundle.");
  if (cut.chosen == 0.0) return;
  list.table("selector");
  list.add("plugin", text("contribution"),
           "Whole regions need more memory than is allowed: only cells that contribute are kept.");
  list.add("max_bytes", fmt::format("{:.0f}", cut.chosen),
           fmt::format("{:g} maps of so many stored bytes take about {} of memory.", kMapsHeld,
                       about(kMapsHeld * kUnpacked * cut.chosen)));
  if (known.scans && !known.scans->elevations.empty()) {
    const auto degrees = [&](double share) {
      return std::round(known.scans->elevation_at(share) * kDegrees);
    };
    list.add("lowest", number(degrees(0.001)),
             "Nearly all points of the scans are above this elevation [deg], and below the next.");
    list.add("highest", number(degrees(0.999)), "");
  } else {
    list.add("lowest", "-23.0", "YOURS: elevations of the sensor's lowest and highest rays [deg].");
    list.add("highest", "15.0", "");
  }
}

void decide_matching(List& list, const Known& known) {
  list.table("matcher");
  list.add("plugin", text("ndt"),
           "The fastest matcher; it needs the fewest bytes of a map for the same error.");
  const double resolution = resolution_for(known.map.spacing);
  const double across = known.map.spacing > 0.0 ? resolution / known.map.spacing : 0.0;
  list.add("params", fmt::format("{{ resolution = {} }}", number(resolution)),
           across > 0.0 ? fmt::format("Map points lie about {:.2g} m apart, so a surface across a "
                                      "cell of this edge [m] has about {:.0f} points; a cell needs "
                                      "6.",
                                      known.map.spacing, across * across)
                        : std::string("The edge of a cell [m]."));
}

void decide_undistortion(List& list, const checks::ScanFacts& scans) {
  constexpr double kShortest = 1e-4, kLongest = 1.0;  // sweeps, as `vantage check` has them [s]
  if (!scans.timed) {
    list.add("undistort", "true",
             "The points have no times, so nothing can be undistorted: sweeps of a moving sensor "
             "stay distorted, unless the driver has done it.");
    return;
  }
  const bool odd = scans.sweep < kShortest || scans.sweep > kLongest;
  list.add("undistort", odd ? "false" : "true",
           fmt::format("The points have times over {:.3g} s a scan{}", scans.sweep,
                       odd ? ", which cannot be seconds of a sweep."
                           : ". YOURS: false, if the driver has undistorted them already."));
}

void decide_localizer(List& list, const Known& known, const Cut& cut, double reach) {
  constexpr double kOwn = 1.0;        // [m]
  constexpr double kMuchNear = 0.02;  // of the points
  constexpr double kTilted = 10.0;    // [deg]
  list.table("localizer");
  if (known.scans) {
    const double near = known.scans->share_within(0.0, kOwn);
    const bool own = near < kMuchNear;
    list.add("scan_min_range", own ? number(kOwn) : "0.0",
             fmt::format("{:.1f} % of the points are nearer than {:g} m{}", 100.0 * near, kOwn,
                         own ? ": they belong to the robot itself."
                             : ": too many to be only the robot itself."));
    if (cut.width > 0.0) {
      list.add("scan_max_range", number(reach), "Regions have nothing that is farther away.");
    }
    decide_undistortion(list, *known.scans);
    const auto& below = known.scans->below;
    if (below && below->tilt * kDegrees > kTilted && !known.imu) {
      list.add("gravity", text("unknown"),
               fmt::format("The ground of the scans is tilted by about {:.0f} degrees, and no IMU "
                           "tells where up is.",
                           below->tilt * kDegrees));
    }
  }
  if (known.imu) {
    const Pose& T = known.imu->T_sensor_imu;
    const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
    const double roll = std::atan2(R(2, 1), R(2, 2)), yaw = std::atan2(R(1, 0), R(0, 0)),
                 pitch = std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2)));
    const auto rounded = [](double x) { return number(std::round(x * 1e4) / 1e4 + 0.0); };
    list.add("T_sensor_imu",
             fmt::format("[{}, {}, {}, {}, {}, {}]", rounded(T.translation.x()),
                         rounded(T.translation.y()), rounded(T.translation.z()), rounded(roll),
                         rounded(pitch), rounded(yaw)),
             known.imu->why + ".");
  }
  list.add("map_memory",
           number(std::round(static_cast<double>(known.memory) / (1U << 20U) * 10.0) / 10.0),
           "MiB, as allowed by --memory.");
}

void append_comment(std::string& out, const std::string& sentence) {
  constexpr std::size_t kColumns = 100;
  std::istringstream words(sentence);
  std::string line = "#";
  for (std::string word; words >> word;) {
    if (line.size() + 1 + word.size() > kColumns && line.size() > 1) {
      out += line + '\n';
      line = "#";
    }
    line += ' ' + word;
  }
  out += line + '\n';
}

}  // namespace

std::string bundle_name(const std::filesystem::path& of) {
  std::filesystem::path path = of.lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  std::string name = path.stem().string();
  const bool is_folder = name == "." || name == "..";
  if (name.empty() || is_folder || name.find_first_of("*?[") != std::string::npos) return "map";
  return name;
}

bool has_ground(const checks::MapFacts& map) noexcept {
  // Flat squares of the ground plan: 54 % on the recorded street, 81 to 84 % on simulated campuses;
  // 21 % on the campus of another day, whose ground was removed, and 28 % on the street without the
  // lowest 0.3 m of each square metre.
  constexpr double kFlat = 0.4;
  return map.flat_share >= kFlat;
}

double resolution_for(double spacing) noexcept {
  constexpr double kDense = 0.4;  // [m]: six points of a surface in a square metre
  return spacing > kDense ? 2.0 : 1.0;
}

double reach_of(const std::optional<checks::ScanFacts>& scans) noexcept {
  constexpr double kTypical = 100.0, kLeast = 20.0, kMost = 120.0, kStep = 10.0;  // [m]
  if (!scans) return kTypical;
  return std::clamp(std::ceil(scans->range_at(0.999) / kStep) * kStep, kLeast, kMost);
}

Result<std::vector<Decision>> decide(const Known& known) {
  const double reach = reach_of(known.scans);
  VANTAGE_TRY(const Cut cut, cut_for(known, reach));
  List list;
  list.add("schema", "1", "");
  list.table("map");
  list.add("files", fmt::format("[{}]", text(known.files)), "");
  if (known.trajectory) {
    list.add("trajectory", text(*known.trajectory), known.trajectory_why);
  }
  decide_regions(list, known, cut);
  decide_viewpoints(list, known);
  decide_visibility(list, known, cut, reach);
  decide_storage(list, known, cut);
  decide_matching(list, known);
  decide_localizer(list, known, cut, reach);
  return std::move(list).take();
}

std::string to_toml(const std::vector<Decision>& decisions, const std::vector<std::string>& head) {
  std::string out;
  for (const std::string& line : head) out += line.empty() ? "#\n" : "# " + line + '\n';
  std::string table;
  for (const Decision& decision : decisions) {
    if (decision.table != table) {
      table = decision.table;
      out += fmt::format("\n[{}]\n", table);
    }
    if (!decision.why.empty()) append_comment(out, decision.why);
    out += fmt::format("{} = {}\n", decision.key, decision.value);
  }
  return out;
}

}  // namespace vantage::init
