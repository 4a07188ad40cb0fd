#include "simulate/crowd.hpp"

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

constexpr double kNearest = 1.0, kFarthest = 5.0;      // [m]
constexpr double kRadius = 0.25, kHeight = 1.75;       // [m]
constexpr double kSwayMetres = 0.3, kSwayAngle = 0.2;  // [m, rad]

}  // namespace

Crowd::Crowd(const LidarParams& params, std::uint64_t seed) : height_(params.height) {
  constexpr double kPi = std::numbers::pi;
  for (int k = 0; k < params.people; ++k) {
    Random random(hash(seed, Purpose::crowd, k));
    const double azimuth = kPi * random.symmetric();
    const double distance = random.uniform(kNearest, kFarthest);
    const double phase = kPi * random.symmetric();
    people_.push_back({azimuth, distance, phase, random.uniform(0.5, 2.0)});
  }
}

std::optional<Hit> Crowd::before(const std::optional<Hit>& surface,
                                 const Eigen::Vector3d& direction, double seconds) const {
  std::optional<Hit> nearest = surface;
  const double plan = direction.head<2>().norm();
  if (people_.empty() || plan < 1e-9) return nearest;
  const Eigen::Vector2d ahead = direction.head<2>() / plan;
  for (const Person& person : people_) {
    const double sway = std::sin(person.phase + person.frequency * seconds);
    const double azimuth = person.azimuth + kSwayAngle * sway;
    const double distance = person.distance + kSwayMetres * sway;
    const Eigen::Vector2d centre(distance * std::cos(azimuth), distance * std::sin(azimuth));
    const double along = ahead.dot(centre);
    const double beside = ahead.x() * centre.y() - ahead.y() * centre.x();
    if (along <= 0.0 || std::abs(beside) >= kRadius) continue;
    const double cosine = std::sqrt(1.0 - beside * beside / (kRadius * kRadius));
    const double range = (along - kRadius * cosine) / plan;
    const double above = height_ + range * direction.z();  // the feet
    if (above < 0.0 || above > kHeight || (nearest && nearest->range <= range)) continue;
    nearest = Hit{.range = range, .cos_incidence = cosine * plan, .surface = Surface::pole};
  }
  return nearest;
}

}  // namespace vantage::simulation
