#include "simulate/imu.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kRadians = std::numbers::pi / 180.0;  // of a degree
constexpr double kReach = 0.02;                        // of the mean of an acceleration [s]
constexpr double kLead = 1.0;                          // of a drive that starts still [s]

Vector3d normal_vector(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

/// @param bias    three numbers, or a norm
/// @param number  each sensor has its own direction
Vector3d bias_of(const std::vector<double>& bias, std::uint64_t seed, int number) {
  if (bias.size() == 3) return {bias[0], bias[1], bias[2]};
  Random random(hash(seed, Purpose::imu_bias, number));
  return bias[0] * normal_vector(random).normalized();
}

Vector3d rotation_vector(const Pose& from, const Pose& to) {
  const Eigen::AngleAxisd turned(
      Eigen::Quaterniond(from.rotation.conjugate() * to.rotation).normalized());
  return turned.angle() * turned.axis();
}

}  // namespace

std::vector<ImuSample> simulate_imu(const Drive& drive, const ImuParams& params,
                                    std::uint64_t seed) {
  const double rate = params.rate.value();
  const double interval = 1.0 / rate;
  const double reach = std::max(1.0, std::round(kReach * rate)) / rate;
  const Pose T_sensor_imu = pose_from_xyz_rpy(
      params.position, kRadians * Vector3d(params.roll, params.pitch, params.yaw));
  const Vector3d gyro_bias = kRadians * bias_of(params.gyro_bias, seed, 0);
  const Vector3d accel_bias = bias_of(params.accel_bias, seed, 1);
  // White noise of this density, averaged over a sampling interval.
  const double gyro_noise = params.gyro_noise * std::sqrt(rate);
  const double accel_noise = params.accel_noise * std::sqrt(rate);

  std::vector<ImuSample> samples;
  constexpr double kRounding = 1e-3;  // of a sample
  const double last = std::floor((drive.end() - drive.stamp(0)) * rate + kRounding) + 1.0;
  const double first = drive.pace().starts_still() ? -std::floor(kLead * rate) : 0.0;
  for (double k = first; k <= last; ++k) {
    const double now = k / rate;
    const auto at = [&](double moment) { return drive.pose_near(moment, now) * T_sensor_imu; };
    const Pose pose = at(now);
    const Vector3d acceleration =
        (at(now + reach).translation - 2.0 * pose.translation + at(now - reach).translation) /
        (reach * reach);
    const Vector3d rates =
        rotation_vector(at(now - interval / 2.0), at(now + interval / 2.0)) / interval;
    Random random(hash(seed, Purpose::imu, static_cast<std::int64_t>(k)));
    ImuSample sample;
    sample.stamp = drive.stamp(0) + now + params.clock_offset;
    sample.angular_velocity = rates + gyro_bias + gyro_noise * normal_vector(random);
    sample.specific_force =
        pose.rotation.conjugate() * Vector3d(acceleration + kGravity * Vector3d::UnitZ()) +
        accel_bias + accel_noise * normal_vector(random);
    samples.push_back(sample);
  }
  return samples;
}

std::string to_csv(std::span<const ImuSample> samples, AccelerationUnit unit) {
  const double scale = unit == AccelerationUnit::g ? 1.0 / kGravity : 1.0;
  std::string text = "t,wx,wy,wz,ax,ay,az\n";
  for (const ImuSample& sample : samples) {
    const Vector3d &w = sample.angular_velocity, a = scale * sample.specific_force;
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{}\n", sample.stamp, w.x(), w.y(),
                   w.z(), a.x(), a.y(), a.z());
  }
  return text;
}

}  // namespace vantage::simulation
