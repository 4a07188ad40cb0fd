#include "integrity_scenarios.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <utility>

#include "drive.hpp"
#include "simulate/random.hpp"

namespace vantage::benchmarks {
namespace {

constexpr std::size_t kScansAfterWrongStart = 30;
constexpr double kLateOdometry = 0.05;  // [s]
constexpr double kSearchBudget = 20.0;  // [ms]

/// 5 to 40 m and any heading off, within the campus.
Pose wrong_start(const Pose& T_map_sensor, const simulation::WorldParams& params,
                 std::size_t part) {
  simulation::Random random(hash(params.seed, 0x577a47U, part));
  constexpr double kPi = std::numbers::pi, kBorder = 5.0;
  while (true) {
    const double metres = random.uniform(5.0, 40.0), direction = kPi * random.symmetric();
    const Point place =
        T_map_sensor.translation + metres * Point(std::cos(direction), std::sin(direction), 0.0);
    const double turn = kPi * random.symmetric();
    if (std::abs(place.x() - params.campus.origin_x) > params.campus.size_x / 2.0 - kBorder ||
        std::abs(place.y() - params.campus.origin_y) > params.campus.size_y / 2.0 - kBorder) {
      continue;
    }
    return {.rotation = rotation_from_vector({0.0, 0.0, turn}) * T_map_sensor.rotation,
            .translation = place};
  }
}

/// GNSS among buildings: 1.5 m off all the time, and 30 m off in the middle third of the drive.
PosePrior biased_prior(const SimulatedDrive& drive, std::size_t i) {
  const bool jumps = 3 * i >= drive.scans.size() && 3 * i < 2 * drive.scans.size();
  PosePrior prior{.T_map_sensor = drive.reference[i].pose};
  prior.T_map_sensor.translation += Point(jumps ? 30.0 : 1.5, 0.0, 1.0);
  prior.sigma_translation = {3.0, 3.0, 3.0};
  return prior;
}

JudgedScan judge(const ScanReport& report, const std::optional<Pose>& truth) {
  JudgedScan scan{.stamp = report.stamp,
                  .tracking = report.tracking,
                  .risk = report.risk,
                  .has_pose = report.has_pose,
                  .metres = std::numeric_limits<double>::infinity(),
                  .seconds_align = report.seconds_align,
                  .seconds_search = report.seconds_search,
                  .reason = report.reason};
  if (report.has_pose && truth) {
    const PoseError error = error_of(report.T_map_scan, *truth);
    scan.metres = error.centimetres / 100.0;
    scan.degrees = error.degrees;
  }
  if (report.alignment) {
    scan.nvtl = report.alignment->score.nvtl;
    scan.coverage = report.alignment->score.coverage;
  }
  return scan;
}

/// The way since the scan before, which is not that of a kidnap [m].
double driven(const SimulatedDrive& drive, const Task& task, std::size_t i) {
  if (i == task.begin || drive.kidnapped[i]) return 0.0;
  return (drive.reference[i].pose.translation - drive.reference[i - 1].pose.translation).norm();
}

}  // namespace

DriveNeeds needs_of(Scenario scenario, int kidnaps, int stretch) {
  switch (scenario) {
    case Scenario::constant_velocity: return {};
    case Scenario::kidnap:
    case Scenario::budget: return {.kidnaps = kidnaps, .stretch = stretch};
    case Scenario::live: return {.kidnaps = kidnaps};
    case Scenario::slip: return {.slips = true, .stretch = stretch};
    case Scenario::odometry:
    case Scenario::wrong_start:
    case Scenario::prior:
    case Scenario::late_odometry: return {.stretch = stretch};
  }
  return {};
}

Result<simulation::WorldParams> params_of(const NamedWorld& world, std::uint64_t seed,
                                          const DriveNeeds& needs) {
  std::vector<std::string> more;
  if (needs.slips) more.emplace_back("odometry.slip=0.2");
  VANTAGE_TRY(auto params, params_of(world, seed, needs.kidnaps, more));
  if (params.lidar.motion_distortion) return params;
  if (params.drive.length) *params.drive.length *= needs.stretch;
  params.drive.scan_every *= needs.stretch;
  return params;
}

Result<JudgedDrive> judged_drive(const NamedWorld& world, const simulation::WorldParams& params,
                                 std::size_t most_scans) {
  VANTAGE_TRY(SimulatedDrive drive, simulated_drive(params, most_scans, params.seed));
  if (world.map.bend != 0.0) {
    for (auto& [stamp, pose] : drive.reference) pose = bent(pose, world.map.bend, params.campus);
  }
  if (!world.axes.isIdentity(0.0)) {
    for (PointCloud& scan : drive.scans) {
      for (Point& p : scan) p = world.axes * p;
    }
  }
  JudgedDrive judged{.drive = std::move(drive), .truth = {}};
  judged.truth.resize(judged.drive.scans.size());
  if (!world.has_truth()) return judged;
  const Pose axes{.rotation = Eigen::Quaterniond(Eigen::Matrix3d(world.axes.transpose()))};
  for (std::size_t i = 0; i < judged.truth.size(); ++i) {
    judged.truth[i] = judged.drive.reference[i].pose * axes;
  }
  return judged;
}

std::vector<Task> tasks_of(const NamedWorld& world, Scenario scenario, const SimulatedDrive& drive,
                           const simulation::WorldParams& params) {
  const std::size_t scans = drive.scans.size();
  if (scenario != Scenario::wrong_start) {
    return {
        {.scenario = scenario, .start = drive.reference.front().pose, .begin = 0, .end = scans}};
  }
  std::vector<Task> tasks;
  const auto starts = static_cast<std::size_t>(world.wrong_starts);
  const std::size_t length = std::min(kScansAfterWrongStart, scans);
  for (std::size_t k = 0; k < starts; ++k) {
    const std::size_t begin = k * (scans - length) / std::max<std::size_t>(1, starts - 1);
    tasks.push_back({.scenario = scenario,
                     .part = k,
                     .start = wrong_start(drive.reference[begin].pose, params, k),
                     .begin = begin,
                     .end = begin + length});
  }
  return tasks;
}

LocalizerParams params_in(Scenario scenario, LocalizerParams params) {
  if (scenario == Scenario::budget || scenario == Scenario::live) {
    params.search_budget = kSearchBudget;
  }
  params.live = params.live || scenario == Scenario::live;
  return params;
}

Result<std::vector<JudgedScan>> localize(Localizer localizer, const Task& task,
                                         const JudgedDrive& judged) {
  const SimulatedDrive& drive = judged.drive;
  VANTAGE_CHECK(localizer.start(task.start));
  const auto began = std::chrono::steady_clock::now();
  std::vector<JudgedScan> scans;
  for (std::size_t i = task.begin; i < task.end; ++i) {
    const double stamp = drive.reference[i].stamp;
    if (task.scenario == Scenario::live) {
      const std::chrono::duration<double> since(stamp - drive.reference[task.begin].stamp);
      std::this_thread::sleep_until(
          began + std::chrono::duration_cast<std::chrono::steady_clock::duration>(since));
    }
    if (task.scenario != Scenario::constant_velocity) {
      const double late = task.scenario == Scenario::late_odometry ? kLateOdometry : 0.0;
      VANTAGE_CHECK(localizer.add(OdometrySample{stamp + late, drive.odometry[i].pose}));
    }
    Scan scan = drive.scan(i);
    if (task.scenario == Scenario::prior) scan.prior = biased_prior(drive, i);
    VANTAGE_TRY(const ScanReport report, localizer.localize(scan));
    scans.push_back(judge(report, judged.truth[i]));
    scans.back().driven = driven(drive, task, i);
    scans.back().misled =
        drive.kidnapped[i] || (task.scenario == Scenario::wrong_start && i == task.begin);
  }
  return scans;
}

}  // namespace vantage::benchmarks
