#include "info/recording_info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "checks/notes.hpp"
#include "info/lines.hpp"
#include "info/map_lines.hpp"
#include "io/autoware_tiles.hpp"
#include "io/formats.hpp"
#include "io/ros/bag_scans.hpp"
#include "io/ros/messages.hpp"
#include "terminal/table.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/file_system.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

constexpr double kGap = 1.5;  // median intervals

double median_interval(const std::vector<double>& stamps) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) intervals.push_back(stamps[i] - stamps[i - 1]);
  if (intervals.empty()) return 0.0;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

/// @param damage  gets the error at which the recording ends after at least one scan
Result<ScansInfo> read_scans(io::ScanSource& source, std::optional<Error>& damage,
                             const std::function<void(std::size_t, std::size_t)>& progress) {
  ScansInfo info;
  info.description = source.describe();
  const std::size_t expected = info.description.scans.value_or(0);
  std::vector<double> stamps;
  while (true) {
    auto next = source.next();
    if (!next && !stamps.empty()) {
      damage = std::move(next).error();
      break;
    }
    VANTAGE_TRY(const auto scan, std::move(next));
    if (!scan) break;
    const std::uint64_t points = scan->points.size();
    info.fewest = stamps.empty() ? points : std::min(info.fewest, points);
    info.most = std::max(info.most, points);
    info.points.add(scan->points, scan->dropped);
    info.no_returns += scan->no_returns;
    if (!scan->seconds.empty()) {
      const auto [first, last] = std::minmax_element(scan->seconds.begin(), scan->seconds.end());
      info.sweep = std::max(info.sweep, static_cast<double>(*last) - static_cast<double>(*first));
      ++info.with_times;
    }
    stamps.push_back(scan->stamp);
    if (progress) progress(stamps.size(), expected);
  }
  info.skipped = source.skipped();
  info.count = stamps.size();
  if (stamps.empty()) return info;
  info.first = stamps.front();
  info.last = stamps.back();
  info.interval = median_interval(stamps);
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const double seconds = stamps[i] - stamps[i - 1];
    if (seconds > kGap * info.interval) info.gaps.push_back({stamps[i - 1], seconds});
  }
  return info;
}

/// Each topic of inertial samples. What is wrong with one does not hide the rest of a bag.
std::vector<ImuInfo> imus_of(const fs::path& path, const std::vector<io::ros::Topic>& topics) {
  std::vector<ImuInfo> imus;
  for (const io::ros::Topic& topic : topics) {
    const auto is_known = [&](const ImuInfo& imu) { return imu.topic == topic.name; };
    if (topic.type != io::ros::kImu || !topic.encoding ||
        std::any_of(imus.begin(), imus.end(), is_known)) {
      continue;
    }
    ImuInfo imu{.topic = topic.name, .recording = {}, .problem = {}};
    if (auto recording = io::read_imu({.path = path, .topic = topic.name})) {
      imu.recording = *std::move(recording);
    } else {
      imu.problem = recording.error().message;
    }
    imus.push_back(std::move(imu));
  }
  return imus;
}

Result<RecordingInfo> inspect_imu(RecordingInfo info) {
  std::error_code error;
  info.format = fs::is_directory(info.path, error) ? "KITTI oxts" : "IMU CSV";
  VANTAGE_TRY(auto recording, io::read_imu({.path = info.path}));
  info.imus.push_back({.topic = {}, .recording = std::move(recording), .problem = {}});
  return info;
}

/// The files of a map, if it can be nothing else: LAS files, Autoware's tiles. Folders of PCD and
/// PLY files are scans.
Result<io::MapFiles> files_of_map(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    return io::MapFiles{.files =
                            io::is_only_map(path) ? std::vector{path} : std::vector<fs::path>()};
  }
  const bool tiled = fs::exists(path / io::kAutowareMetadata, error) ||
                     fs::exists(path.parent_path() / io::kAutowareMetadata, error);
  const std::vector<fs::path> pattern{path};
  auto found = io::map_files(pattern);
  if (!found && !tiled) return io::MapFiles();
  if (!found || tiled) return found;
  const bool las = std::any_of(found->files.begin(), found->files.end(), io::is_only_map);
  return las ? found : io::MapFiles();
}

/// Fewer points are taken for a scan.
constexpr std::size_t kFewestOfMap = 300'000;

Result<RecordingInfo> inspect_map(RecordingInfo info) {
  PointsInfo points;
  std::uint64_t most = kFewestOfMap;
  for (const fs::path& file : info.map_files) {
    VANTAGE_TRY(const auto cloud, io::read_point_cloud(file));
    points.add(cloud.points, cloud.dropped);
    if (cloud.points.size() <= most) continue;
    most = cloud.points.size();
    info.map_facts = checks::measure_map(cloud.points);
  }
  info.map = points;
  return info;
}

}  // namespace

void PointsInfo::add(PointsView points, std::uint64_t not_finite) {
  finite += points.size();
  dropped += not_finite;
  for (const Point& point : points) extent.extend(point);
}

Result<RecordingInfo> inspect(const io::ScanOptions& options,
                              const std::function<void(std::size_t, std::size_t)>& progress) {
  RecordingInfo info;
  info.path = options.path;
  info.bytes = io::bytes_of(options.path);
  std::error_code error;
  if (!fs::exists(options.path, error)) {
    return fail(ErrorCode::not_found, "no such file or directory, expected scans or a map",
                SourceLocation{options.path.string(), 0, 0});
  }
  std::unique_ptr<io::ros::MessageReader> bag;
  VANTAGE_TRY(const bool is_bag, io::ros::is_bag(options.path));
  if (is_bag) {
    VANTAGE_TRY(bag, io::ros::open_bag(options.path));
    info.format = bag->format();
    info.topics = bag->topics();
    info.imus = imus_of(options.path, info.topics);
    for (const ImuInfo& imu : info.imus) {
      if (imu.recording && imu.recording->damage) info.damage = imu.recording->damage;
    }
  } else if (io::is_imu(options.path)) {
    return inspect_imu(std::move(info));
  }
  VANTAGE_TRY(auto map, files_of_map(options.path));
  if (!map.files.empty()) {
    info.map_files = std::move(map.files);
    VANTAGE_TRY(auto layout, io::read_cloud_layout(info.map_files.front()));
    info.map_fields = std::move(layout.fields);
    info.format = info.map_files.size() == 1
                      ? layout.format
                      : fmt::format("map of {}, {}", cli::counted(info.map_files.size(), "file"),
                                    layout.format);
    return inspect_map(std::move(info));
  }
  // What opens without an index is read as a whole to open it: once is enough.
  auto source = is_bag ? io::ros::bag_scans(std::move(bag), options) : io::open_scans(options);
  if (!source && is_bag && options.topic.empty() &&
      source.error().code == ErrorCode::invalid_input) {
    info.no_scans = source.error().message;
    return info;
  }
  if (!source) return fail(std::move(source).error());
  info.format = (*source)->describe().format;
  VANTAGE_TRY(info.scans, read_scans(**source, info.damage, progress));
  if (info.scans->count == 1 && info.scans->points.finite > kFewestOfMap &&
      fs::is_regular_file(options.path, error)) {
    VANTAGE_TRY(const auto cloud, io::read_point_cloud(options.path));
    info.map_facts = checks::measure_map(cloud.points);
  }
  return info;
}

}  // namespace vantage
