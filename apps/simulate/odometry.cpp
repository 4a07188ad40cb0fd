#include "simulate/odometry.hpp"

#include <cmath>
#include <numbers>

#include "simulate/random.hpp"

namespace vantage::simulation {

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
