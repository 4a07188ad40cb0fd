#include "simulate/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "simulate/random.hpp"

namespace vantage::simulation {

namespace {

constexpr double kSlipEvery = 10.0;  // of the way, there is one piece on which the wheels slip [m]

Pose in_map(const World& world, Pose T_campus_sensor) {
  T_campus_sensor.translation += world.map_origin();
  return T_campus_sensor;
}

std::vector<double> stamps_of_scans(const Drive& drive) {
  std::vector<double> stamps;
  for (std::size_t k = 0; k < drive.scans(); ++k) stamps.push_back(drive.stamp(k));
  return stamps;
}

/// The part of the way from `from` to `to` [m] on which the wheels slip [m].
double slipped(double from, double to, double share, std::uint64_t seed) {
  double sum = 0.0;
  for (double stretch = std::floor(from / kSlipEvery); stretch * kSlipEvery < to; ++stretch) {
    Random random(hash(seed, Purpose::slip, static_cast<std::int64_t>(stretch)));
    const double begin = kSlipEvery * (stretch + (1.0 - share) * random.uniform());
    sum += std::max(0.0, std::min(to, begin + share * kSlipEvery) - std::max(from, begin));
  }
  return sum;
}

}  // namespace

io::Trajectory truth_at(const World& world, const Drive& drive, std::span<const double> stamps) {
  io::Trajectory truth;
  truth.reserve(stamps.size());
  for (const double stamp : stamps) truth.push_back({stamp, in_map(world, drive.pose(stamp))});
  return truth;
}

io::Trajectory reference_of(const World& world, const Drive& drive) {
  return truth_at(world, drive, stamps_of_scans(drive));
}

std::vector<double> stamps_of_odometry(const Drive& drive, const OdometryParams& params) {
  if (!params.rate) return stamps_of_scans(drive);
  constexpr double kRounding = 1e-6;
  const double seconds = drive.end() - drive.stamp(0);
  std::vector<double> stamps;
  for (double k = 0.0; k <= seconds * *params.rate + kRounding; ++k) {
    stamps.push_back(drive.stamp(0) + k / *params.rate);
  }
  return stamps;
}

io::Trajectory without_kidnaps(const World& world, const Drive& drive,
                               const io::Trajectory& truth) {
  io::Trajectory felt;
  felt.reserve(truth.size());
  std::optional<Pose> T_felt_map;  // none before the first kidnap
  auto kidnap = drive.kidnaps().begin();
  for (const auto& [stamp, pose] : truth) {
    for (; kidnap != drive.kidnaps().end() && drive.stamp(kidnap->scan) <= stamp; ++kidnap) {
      const Pose driven_on = in_map(world, drive.pose_driven_on(kidnap->scan));
      const Pose landed = in_map(world, drive.pose(drive.stamp(kidnap->scan)));
      T_felt_map = T_felt_map.value_or(Pose{}) * driven_on * landed.inverse();
    }
    felt.push_back({stamp, T_felt_map ? *T_felt_map * pose : pose});
  }
  return felt;
}

io::Trajectory simulate_odometry(const io::Trajectory& truth, const OdometryParams& params,
                                 std::uint64_t seed) {
  const double rotation_noise = params.rotation_noise * std::numbers::pi / 180.0;
  io::Trajectory odometry;
  odometry.reserve(truth.size());
  double driven = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (k == 0) {
      odometry.push_back({truth[k].stamp, Pose{}});
      continue;
    }
    Pose motion = truth[k - 1].pose.inverse() * truth[k].pose;
    const double length = motion.translation.norm();
    const double scale = std::sqrt(length);
    if (params.slip > 0.0 && length > 0.0) {
      const double share = slipped(driven, driven + length, params.slip, seed) / length;
      motion.translation *= 1.0 + (params.slip_factor - 1.0) * share;
    }
    driven += length;
    Random random(hash(seed, Purpose::odometry, k));
    const auto draw = [&](double deviation) {
      const double x = random.normal(), y = random.normal(), z = random.normal();
      return Eigen::Vector3d(deviation * Eigen::Vector3d(x, y, z));
    };
    Pose error;
    error.translation = draw(params.translation_noise * scale);
    error.rotation = rotation_from_vector(draw(rotation_noise * scale));
    odometry.push_back({truth[k].stamp, odometry.back().pose * motion * error});
  }
  return odometry;
}

}  // namespace vantage::simulation
