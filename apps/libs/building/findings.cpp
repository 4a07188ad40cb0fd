#include "building/findings.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <string>
#include <system_error>
#include <utility>

#include "checks/notes.hpp"
#include "vantage/build/bundle_build.hpp"
#include "vantage/kit/file_system.hpp"

namespace vantage::building {
namespace {

namespace fs = std::filesystem;

/// A folder that goes with this object.
class TemporaryFolder {
 public:
  /// Errors: `io_failure`.
  [[nodiscard]] static Result<TemporaryFolder> create() {
    std::error_code error;
    std::string path = (fs::temp_directory_path(error) / "vantage-check-XXXXXX").string();
    if (error || ::mkdtemp(path.data()) == nullptr) {
      return io::system_error(path, "no temporary folder can be created",
                              error ? error.value() : errno);
    }
    return TemporaryFolder(std::move(path));
  }
  TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  [[nodiscard]] const fs::path& path() const noexcept { return path_; }

 private:
  explicit TemporaryFolder(fs::path path) : path_(std::move(path)) {}

  fs::path path_;
};

/// A bundle of the whole map, for as long as scans are tried in it.
class WholeMap {
 public:
  static Result<WholeMap> build(Config config, const WideAreaMap& map,
                                const PluginLoader& plugins) {
    VANTAGE_TRY(TemporaryFolder folder, TemporaryFolder::create());
    config.partitioner = PluginChoice{};
    config.partitioner->plugin = "whole_map";
    config.visibility = VisibilityConfig{};
    config.visibility->plugin = "keep_all";
    config.store = StoreConfig{};
    config.store->plugin = "pcd_tiles";
    config.store->params.entries.push_back({"root", {(folder.path() / "bundle").string(), {}}, {}});
    config.thinning.reset();
    config.selector.reset();
    VANTAGE_TRY(BundleBuild build, BundleBuild::prepare(config, plugins));
    VANTAGE_CHECK(build.run(map.points, map.trajectory));
    VANTAGE_TRY(Bundle bundle, Bundle::open(config, plugins, "the check"));
    return WholeMap(std::move(folder), std::move(config), std::move(bundle));
  }
  [[nodiscard]] const Config& config() const { return config_; }
  [[nodiscard]] const Bundle& bundle() const { return bundle_; }

 private:
  WholeMap(TemporaryFolder folder, Config config, Bundle bundle)
      : folder_(std::move(folder)), config_(std::move(config)), bundle_(std::move(bundle)) {}

  TemporaryFolder folder_;
  Config config_;
  Bundle bundle_;
};

/// Takes the map for one in feet. Its cells are too wide for sparse scans to fit, so that scaled
/// scans show nothing.
Result<std::optional<checks::Note>> try_feet(const Config& config, const WideAreaMap& map,
                                             std::span<const io::StampedScan> scans,
                                             const checks::Fit& as_they_are,
                                             const PluginLoader& plugins) {
  constexpr double kFoot = 0.3048;  // [m]
  WideAreaMap metric;
  for (const Point& p : map.points) metric.points.push_back(kFoot * p);
  for (const Point& p : map.trajectory) metric.trajectory.push_back(kFoot * p);
  VANTAGE_TRY(const WholeMap whole, WholeMap::build(config, metric, plugins));
  VANTAGE_TRY(const checks::Fit fit,
              checks::fit_of(whole.bundle(), whole.config(), plugins, scans, {}));
  if (!finds_more(fit, as_they_are)) return std::optional<checks::Note>();
  return std::optional<checks::Note>(
      {fmt::format("{} of {} scans are found if the map is taken as feet, and {} if it is not",
                   fit.found, fit.scans, as_they_are.found),
       "scans and map are in metres: multiply the map by 0.3048"});
}

struct Comparison {
  checks::Fit fit;
  std::optional<checks::Note> note;
};

/// Localizes the scans in the map, and says what that shows.
Result<Comparison> compare(const Config& config, const WideAreaMap& map,
                           std::span<const io::StampedScan> scans, std::span<const ImuSample> imu,
                           const PluginLoader& plugins) {
  VANTAGE_TRY(const WholeMap whole, WholeMap::build(config, map, plugins));
  Comparison found;
  VANTAGE_TRY(found.fit, checks::fit_of(whole.bundle(), whole.config(), plugins, scans, imu));
  VANTAGE_TRY(found.note,
              checks::try_changes(whole.bundle(), whole.config(), plugins, scans, found.fit));
  if (!found.note && 2 * found.fit.found < scans.size()) {
    VANTAGE_TRY(found.note, try_feet(config, map, scans, found.fit, plugins));
  }
  if (!found.note) found.note = checks::note_on_place(found.fit);
  if (!found.note && found.fit.found > 0) {
    VANTAGE_TRY(found.note,
                checks::try_scales(whole.bundle(), whole.config(), plugins, scans, imu, found.fit));
  }
  return found;
}

}  // namespace

Result<checks::MapFacts> facts_of(const WideAreaMap& map) {
  if (!map.tiles) return checks::measure_map(map.points);
  VANTAGE_TRY(const PointCloud sample, sample_of(*map.tiles));
  return checks::measure_map(sample);
}

Result<FirstScans> read_first_scans(RunInputs& inputs) {
  constexpr std::size_t kLater = 8;  // where the sensor was is only seen when it has moved
  FirstScans first;
  VANTAGE_TRY(ScansRead read, first_scans(inputs, checks::ScanSurvey::kAmong, kLater));
  first.scans = std::move(read.scans);
  add_damage(inputs, read.damage);
  if (!first.scans.empty() && inputs.opened) {
    const auto stamps = check_stamps(inputs, first.scans.front().stamp, inputs.opened->describe());
    if (!stamps) first.stamps = stamps.error();
  }
  checks::ScanSurvey survey;
  for (const io::StampedScan& scan : first.scans) survey.offer(scan);
  for (const io::StampedScan& scan : read.later) survey.place(scan);
  first.facts = survey.facts();
  if (first.scans.size() > checks::kScansToTry) first.scans.resize(checks::kScansToTry);
  return first;
}

Findings look_at(const checks::MapFacts& map, const Config& config) {
  return {.notes = notes_on(map, config), .fit = {}};
}

Result<Findings> look_at(const checks::MapFacts& map_facts, const Config& config,
                         const WideAreaMap& map, const FirstScans& first,
                         std::span<const ImuSample> imu, const PluginLoader& plugins, bool quiet) {
  Findings findings = look_at(map_facts, config);
  const bool has_imu = !imu.empty();
  std::vector<checks::Note> notes = notes_on(first.facts, config, has_imu);
  if (first.stamps) notes.insert(notes.begin(), checks::note_on_stamps(*first.stamps));
  if (findings.notes.empty() && notes.empty() && config.matcher && !map.tiles) {
    if (!quiet) std::cerr << "comparing scans with the map\n";
    VANTAGE_TRY(auto found, compare(config, map, first.scans, imu, plugins));
    findings.fit = found.fit;
    if (found.note) notes.push_back(*std::move(found.note));
  }
  const auto add = [&](std::vector<checks::Note> more) {
    findings.notes.insert(findings.notes.end(), std::make_move_iterator(more.begin()),
                          std::make_move_iterator(more.end()));
  };
  // Wrong axes make heights wrong, and feet also ranges.
  if (!findings.fit || notes.empty()) add(notes_on_sensor(first.facts, config, has_imu));
  add(std::move(notes));
  return findings;
}

}  // namespace vantage::building
