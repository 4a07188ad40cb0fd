#include "starts.hpp"

#include <cmath>
#include <numbers>

namespace vantage::benchmarks {

std::vector<Pose> starts(const Pose& T_map_scan, const Off& off, std::size_t directions) {
  constexpr double kPi = std::numbers::pi;
  const Eigen::Vector3d ahead = T_map_scan.rotation.toRotationMatrix().col(0);
  const double heading = std::atan2(ahead.y(), ahead.x());
  const std::size_t count = off.metres > 0.0 ? directions : off.degrees > 0.0 ? 2 : 1;
  std::vector<Pose> all;
  for (std::size_t k = 0; k < count; ++k) {
    const double yaw = (k % 2 == 0 ? 1.0 : -1.0) * off.degrees * kPi / 180.0;
    const double direction =
        heading + 2.0 * kPi * static_cast<double>(k) / static_cast<double>(count);
    Pose start = T_map_scan;
    start.rotation = rotation_from_vector({0.0, 0.0, yaw}) * T_map_scan.rotation;
    start.translation += off.metres * Point(std::cos(direction), std::sin(direction), 0.0);
    all.push_back(start);
  }
  return all;
}

}  // namespace vantage::benchmarks
