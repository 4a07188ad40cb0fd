#include "simulate/simulation.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "simulate/drive.hpp"
#include "simulate/imu.hpp"
#include "simulate/lidar.hpp"
#include "simulate/map_sampler.hpp"
#include "simulate/odometry.hpp"
#include "simulate/world.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/atomic_folder.hpp"

namespace vantage::simulation {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWorldFile = "world.toml";

tl::unexpected<Error> cannot(const std::string& what, const fs::path& path,
                             const std::error_code& error) {
  return fail(ErrorCode::io_failure, "cannot " + what + ": " + error.message(),
              SourceLocation{path.string(), 0, 0});
}

/// Whether simulate() makes a file or folder of this name.
bool is_own(std::string_view name) {
  for (const std::string_view one : {"map", "map.pcd", "scans", "scans/times.txt", "reference.tum",
                                     "odometry.tum", "imu.csv", "events.csv", kWorldFile}) {
    if (name == one) return true;
  }
  const std::size_t slash = name.find('/');
  return (name.starts_with("map/") || name.starts_with("scans/")) && name.ends_with(".pcd") &&
         name.find('/', slash + 1) == std::string_view::npos;
}

io::FolderKind kind_of_output() {
  return {.what = "the result of a simulation",
          .overwrite = "--overwrite",
          .check = [](const fs::path& /*folder*/, auto names) -> Result<void> {
            for (const std::string& name : names) {
              if (!is_own(name)) return io::it_holds(name);
            }
            if (names.empty() || std::ranges::count(names, kWorldFile) > 0) return {};
            return fail(ErrorCode::already_exists, std::string("it has no ") + kWorldFile);
          },
          .may_hold = is_own};
}

/// float32 if it moves no point of the box by a millimetre or more.
io::Precision precision_for(const Bounds3& bounds) {
  const double largest = bounds.min.cwiseAbs().cwiseMax(bounds.max.cwiseAbs()).maxCoeff();
  const double rounding = std::max(1.0, largest) * 0x1p-24;  // of one coordinate, at most
  return rounding * std::sqrt(3.0) < 1e-3 ? io::Precision::float32 : io::Precision::float64;
}

std::uint64_t triangles_of(const World& world) {
  const auto cells = static_cast<std::uint64_t>(world.terrain().columns() - 1) *
                     static_cast<std::uint64_t>(world.terrain().rows() - 1);
  std::uint64_t triangles = 2 * cells + world.campus().leaves.size();
  for (const Solid& solid : world.campus().solids) {
    for (const Face& face : solid.faces) triangles += face.corners.size() - 2;
  }
  return triangles;
}

/// Writes points to files of one size, in the order in which they come.
class MapFiles {
 public:
  MapFiles(fs::path folder, std::size_t points_per_file, io::Precision precision)
      : folder_(std::move(folder)), most_(points_per_file), precision_(precision) {}

  Result<void> add(PointsView points) {
    for (const Point& p : points) {
      bounds_.extend(p);
      pending_.push_back(p);
      if (pending_.size() == most_) VANTAGE_CHECK(flush());
    }
    return {};
  }
  Result<void> flush() {
    if (pending_.empty()) return {};
    VANTAGE_CHECK(io::write_pcd(folder_ / fmt::format("{:06}.pcd", files_), pending_, precision_));
    ++files_;
    points_ += pending_.size();
    pending_.clear();
    return {};
  }
  [[nodiscard]] std::uint64_t points() const noexcept { return points_; }
  [[nodiscard]] const Bounds3& bounds() const noexcept { return bounds_; }

 private:
  fs::path folder_;
  std::size_t most_;
  io::Precision precision_;
  PointCloud pending_;
  std::size_t files_ = 0;
  std::uint64_t points_ = 0;
  Bounds3 bounds_;
};

void cut_out(PointCloud& map, std::span<const Hole> holes, const World& world) {
  if (holes.empty()) return;
  const Eigen::Vector2d origin = world.map_origin().head<2>();
  std::erase_if(map, [&](const Point& p) {
    return std::any_of(holes.begin(), holes.end(),
                       [&](const Hole& hole) { return hole.contains(p.head<2>() - origin); });
  });
}

/// A box that the map cannot leave [m].
Bounds3 box_of(const World& world) {
  constexpr double kHighest = 1000.0;
  const Point half(world.terrain().half_size().x(), world.terrain().half_size().y(), kHighest);
  return {world.map_origin() - half, world.map_origin() + half};
}

/// @return  the part of a Summary about the map and the world
Result<Summary> write_map_in_files(const World& world, std::span<const Hole> holes,
                                   const WorldParams& params, const fs::path& folder,
                                   const StageProgress& progress) {
  std::error_code error;
  fs::create_directory(folder, error);
  if (error) return cannot("create the directory", folder, error);
  Summary summary;
  summary.triangles = triangles_of(world);
  summary.precision = precision_for(box_of(world));
  MapFiles files(folder, static_cast<std::size_t>(params.map.points_per_file), summary.precision);
  VANTAGE_CHECK(stream_map(
      world, params.map, params.seed,
      [&](PointCloud&& piece) {
        cut_out(piece, holes, world);
        return files.add(piece);
      },
      [&](std::size_t done, std::size_t total) {
        if (progress) progress("sampling the map", done, total);
      }));
  VANTAGE_CHECK(files.flush());
  summary.map_points = files.points();
  summary.map_bounds = files.bounds();
  return summary;
}

/// @return  the part of a Summary about the map and the world
Result<Summary> write_map(const World& world, std::span<const Hole> holes,
                          const WorldParams& params, const fs::path& folder,
                          const StageProgress& progress) {
  if (params.map.points_per_file > 0) {
    return write_map_in_files(world, holes, params, folder / "map", progress);
  }
  Summary summary;
  summary.triangles = triangles_of(world);
  PointCloud map =
      sample_map(world, params.map, params.seed, [&](std::size_t done, std::size_t total) {
        if (progress) progress("sampling the map", done, total);
      });
  cut_out(map, holes, world);
  summary.map_points = map.size();
  summary.map_bounds = bounds_of(map);
  summary.precision = precision_for(summary.map_bounds);
  VANTAGE_CHECK(io::write_pcd(folder / "map.pcd", map, summary.precision));
  return summary;
}

/// @return  number of points of all scans
Result<std::uint64_t> write_scans(const World& world, const Drive& drive, const WorldParams& params,
                                  const fs::path& folder, const StageProgress& progress) {
  const Lidar lidar(params.lidar, params.seed);
  std::mutex mutex;
  std::uint64_t points = 0;
  std::size_t done = 0;
  std::optional<std::pair<std::size_t, Error>> first_failure;
  tbb::parallel_for(std::size_t{0}, drive.scans(), [&](std::size_t k) {
    {
      const std::scoped_lock lock(mutex);
      if (first_failure && first_failure->first < k) return;
    }
    const Sweep sweep = lidar.sweep(world, drive, k);
    const fs::path file = folder / fmt::format("{:06}.pcd", k);
    auto written = params.lidar.motion_distortion
                       ? io::write_pcd(file, sweep.points, sweep.seconds)
                       : io::write_pcd(file, sweep.points, io::Precision::float32);
    const std::scoped_lock lock(mutex);
    if (!written && (!first_failure || k < first_failure->first)) {
      first_failure.emplace(k, std::move(written).error());
    }
    points += sweep.points.size();
    ++done;
    if (progress) progress("scanning", done, drive.scans());
  });
  if (first_failure) return fail(std::move(first_failure->second));
  return points;
}

/// Drives through the world and writes what the sensor sees. Adds to the summary.
Result<void> write_drive(const World& world, const Drive& drive, const WorldParams& params,
                         const fs::path& folder, Summary& summary, const StageProgress& progress) {
  std::optional<World> other_day;
  if (params.changes.any()) {
    VANTAGE_TRY(other_day, World::create(params, Day::drive));
  }
  const fs::path scans = folder / "scans";
  std::error_code error;
  fs::create_directory(scans, error);
  if (error) return cannot("create the directory", scans, error);
  VANTAGE_TRY(summary.scan_points,
              write_scans(other_day ? *other_day : world, drive, params, scans, progress));
  summary.scans = drive.scans();
  summary.holes = drive.holes().size();

  std::string times, events = "stamp,kidnapped,in_hole\n";
  for (std::size_t k = 0; k < drive.scans(); ++k) {
    times += fmt::format("{}\n", drive.stamp(k));
    events +=
        fmt::format("{},{:d},{:d}\n", drive.stamp(k), drive.is_kidnapped(k), drive.is_in_hole(k));
    if (drive.is_kidnapped(k)) ++summary.kidnaps;
  }
  const io::Trajectory reference = reference_of(world, drive);
  VANTAGE_CHECK(io::write_text_atomically(scans / "times.txt", times));
  VANTAGE_CHECK(io::write_tum(folder / "reference.tum", reference));
  const io::Trajectory felt = without_kidnaps(
      world, drive, truth_at(world, drive, stamps_of_odometry(drive, params.odometry)));
  VANTAGE_CHECK(io::write_tum(folder / "odometry.tum",
                              simulate_odometry(felt, params.odometry, params.seed)));
  summary.odometry_poses = felt.size();
  if (params.imu.rate) {
    const auto samples = simulate_imu(drive, params.imu, params.seed);
    VANTAGE_CHECK(io::write_text_atomically(folder / "imu.csv", to_csv(samples, params.imu.unit)));
    summary.imu_samples = samples.size();
  }
  VANTAGE_CHECK(io::write_text_atomically(folder / "events.csv", events));
  summary.seconds = reference.back().stamp - reference.front().stamp;
  summary.distance = drive.distance(reference.back().stamp);
  return {};
}

}  // namespace

Result<Summary> simulate(const WorldParams& params, const fs::path& out, bool overwrite,
                         Extent extent, const StageProgress& progress) {
  VANTAGE_TRY(auto directory, io::OutputFolder::create(kind_of_output(), out,
                                                       io::OutputFolder::existing(overwrite)));
  // Holes are on the driven path, which needs rays to be found.
  const bool drives = extent == Extent::drive || params.map.holes > 0;
  VANTAGE_TRY(const World world, World::create(params, Day::map, drives ? Rays::yes : Rays::no));
  std::optional<Drive> drive;
  if (drives) {
    VANTAGE_TRY(drive, Drive::create(world, params));
  }
  VANTAGE_TRY(Summary summary, write_map(world, drive ? drive->holes() : std::span<const Hole>(),
                                         params, directory.path(), progress));
  if (extent == Extent::drive) {
    VANTAGE_CHECK(write_drive(world, *drive, params, directory.path(), summary, progress));
  }
  VANTAGE_CHECK(io::write_text_atomically(directory.path() / kWorldFile, to_world_file(params)));
  VANTAGE_CHECK(directory.commit());
  return summary;
}

}  // namespace vantage::simulation
