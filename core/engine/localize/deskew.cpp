#include "vantage/engine/deskew.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>

namespace vantage {
namespace {

/// A motion at constant velocity, in the form that Rodrigues' formula needs. Eigen's product of a
/// pose and a point would make a rotation matrix for each point.
class SteadyMotion {
 public:
  explicit SteadyMotion(const Pose& whole) : translation_(whole.translation) {
    const Eigen::AngleAxisd rotation{Eigen::Quaterniond(whole.rotation)};
    axis_ = rotation.axis();
    angle_ = rotation.angle();
    if (angle_ > std::numbers::pi) angle_ -= 2.0 * std::numbers::pi;  // the short way round
  }

  /// Sets the sensor's pose after this fraction of the motion.
  void set(double fraction) {
    sine_ = std::sin(fraction * angle_);
    one_minus_cosine_ = 1.0 - std::cos(fraction * angle_);
    shift_ = fraction * translation_;
  }

  [[nodiscard]] Point operator*(const Point& p) const {
    const Eigen::Vector3d across = axis_.cross(p);
    return p + sine_ * across + one_minus_cosine_ * axis_.cross(across) + shift_;
  }

 private:
  Eigen::Vector3d translation_, axis_;
  double angle_ = 0.0;
  double sine_ = 0.0, one_minus_cosine_ = 0.0;
  Eigen::Vector3d shift_ = Eigen::Vector3d::Zero();
};

}  // namespace

Result<PointCloud> deskew(PointsView points, std::span<const float> seconds,
                          const Pose& T_now_later, double interval) {
  if (seconds.size() != points.size()) {
    return fail(ErrorCode::invalid_input, "the scan has " + std::to_string(points.size()) +
                                              " points and " + std::to_string(seconds.size()) +
                                              " times, expected one for each");
  }
  if (!(interval > 0.0) || !std::isfinite(interval)) {
    return fail(ErrorCode::invalid_input, "the sensor's motion takes " + std::to_string(interval) +
                                              " s, expected a positive number");
  }
  if (!is_valid(T_now_later)) {
    return fail(ErrorCode::invalid_input, "the sensor's motion is no rigid transform");
  }
  SteadyMotion motion(T_now_later);
  double current = 0.0;  // fraction of the motion
  motion.set(current);
  PointCloud deskewed;
  deskewed.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double fraction = static_cast<double>(seconds[i]) / interval;
    if (!std::isfinite(fraction)) {
      return fail(ErrorCode::invalid_input,
                  "point " + std::to_string(i) + " of the scan was measured " +
                      std::to_string(seconds[i]) + " s after its stamp, expected a finite time");
    }
    if (fraction != current) motion.set(current = fraction);
    deskewed.emplace_back(motion * points[i]);
  }
  return deskewed;
}

}  // namespace vantage
