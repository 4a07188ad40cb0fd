#include "simulate/odometry.hpp"

#include <cmath>
#include <numbers>
#include <optional>

#include "simulate/random.hpp"

namespace vantage::simulation {

io::Trajectory reference_of(const World& world, const Drive& drive) {
  io::Trajectory reference;
  for (std::size_t k = 0; k < drive.scans(); ++k) {
    Pose pose = drive.pose(drive.stamp(k));
    pose.translation += world.map_origin();
    reference.push_back({drive.stamp(k), pose});
  }
  return reference;
}

io::Trajectory without_kidnaps(const World& world, const Drive& drive,
                               const io::Trajectory& reference) {
  io::Trajectory felt;
  std::optional<Pose> T_felt_map;  // none before the first kidnap
  for (std::size_t k = 0; k < reference.size(); ++k) {
    if (drive.is_kidnapped(k)) {
      Pose driven_on = drive.pose_driven_on(k);
      driven_on.translation += world.map_origin();
      T_felt_map = T_felt_map.value_or(Pose{}) * driven_on * reference[k].pose.inverse();
    }
    const Pose& pose = reference[k].pose;
    felt.push_back({reference[k].stamp, T_felt_map ? *T_felt_map * pose : pose});
  }
  return felt;
}

io::Trajectory simulate_odometry(const io::Trajectory& truth, const OdometryParams& params,
                                 std::uint64_t seed) {
  const double rotation_noise = params.rotation_noise * std::numbers::pi / 180.0;
  io::Trajectory odometry;
  odometry.reserve(truth.size());
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (k == 0) {
      odometry.push_back({truth[k].stamp, Pose{}});
      continue;
    }
    const Pose motion = truth[k - 1].pose.inverse() * truth[k].pose;
    const double scale = std::sqrt(motion.translation.norm());
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
