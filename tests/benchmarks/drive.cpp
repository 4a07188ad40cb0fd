#include "drive.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>
#include <unistd.h>

#include <ctime>
#include <fstream>
#include <iostream>
#include <numbers>
#include <utility>

#include "io/scan_sequence.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/voxel_points.hpp"
#include "vantage/track/rotation.hpp"

namespace vantage::benchmarks {

Result<Drive> load_drive(const std::filesystem::path& folder, double scan_voxel,
                         std::size_t scans) {
  Drive drive;
  VANTAGE_TRY(auto map, io::read_point_cloud(folder / "map.pcd"));
  drive.map = std::move(map.points);
  VANTAGE_TRY(const auto reference, io::read_trajectory(folder / "ref_poses_tum.txt"));
  VANTAGE_TRY(const auto sequence, io::ScanSequence::open(folder / "scans", 10.0));
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (scans > 0 && drive.frames.size() == scans) break;
    const auto pose = io::pose_at(reference, sequence.stamp(i));
    if (!pose) continue;
    VANTAGE_TRY(const auto scan, sequence.read(i));
    VANTAGE_TRY(auto thinned, voxel_centroids(scan.points, scan_voxel));
    drive.frames.push_back({sequence.stamp(i), std::move(thinned), *pose});
  }
  if (drive.frames.empty()) return fail(ErrorCode::invalid_input, "no scan has a reference pose");
  return drive;
}

Pose predicted(const std::vector<Pose>& estimates, const std::vector<Frame>& frames) {
  const std::size_t n = estimates.size();
  if (n == 0) return frames[0].T_map_scan;
  if (n == 1) return estimates[0];
  const double fraction =
      (frames[n].stamp - frames[n - 1].stamp) / (frames[n - 1].stamp - frames[n - 2].stamp);
  const Pose step = estimates[n - 2].inverse() * estimates[n - 1];
  return estimates[n - 1] * interpolate(Pose{}, step, fraction);
}

PoseError error_of(const Pose& estimate, const Pose& reference) {
  return {.centimetres = 1e2 * (estimate.translation - reference.translation).norm(),
          .degrees = rotation_between(estimate, reference) * 180.0 / std::numbers::pi};
}

DriveErrors follow(
    const std::vector<Frame>& frames,
    const std::function<Result<Pose>(PointsView scan, const Pose& T_map_scan_guess)>& align) {
  DriveErrors result;
  std::vector<Pose> estimates;
  for (const Frame& frame : frames) {
    const Pose guess = predicted(estimates, frames);
    const auto answer = align(frame.scan, guess);
    if (!answer) ++result.failed;
    estimates.push_back(answer ? *answer : guess);
    const PoseError error = error_of(estimates.back(), frame.T_map_scan);
    result.centimetres.push_back(error.centimetres);
    result.degrees.push_back(error.degrees);
  }
  return result;
}

double resident_megabytes() {
  malloc_trim(0);
  std::ifstream status("/proc/self/statm");
  double pages = 0.0;
  status >> pages >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
}

double cpu_seconds() {
  timespec cpu{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
  return static_cast<double>(cpu.tv_sec) + 1e-9 * static_cast<double>(cpu.tv_nsec);
}

void print_row(const std::vector<std::string>& cells) {
  std::cout << fmt::format("| {} |\n", fmt::join(cells, " | ")) << std::flush;
}

void print_head(const std::string& title, const std::vector<std::string>& columns) {
  std::cout << '\n' << title << "\n\n";
  print_row(columns);
  print_row(std::vector<std::string>(columns.size(), "---"));
}

}  // namespace vantage::benchmarks
