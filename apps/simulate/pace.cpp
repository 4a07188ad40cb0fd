#include "simulate/pace.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

namespace vantage::simulation {
namespace {

constexpr double kTurn = std::numbers::pi / 2.0;  // on the spot, there and back [rad]
constexpr double kRamp = 0.25;                    // until a turn has its full rate [s]

/// A turn by an angle whose rate rises, stays and falls.
struct Turn {
  Turn(double whole, double full_rate)
      : angle(whole),
        growth(full_rate / kRamp),
        rate(std::min(full_rate, std::sqrt(whole * growth))),
        ramp(rate / growth),
        seconds(whole / rate + ramp) {}

  [[nodiscard]] double after(double t) const noexcept {
    if (t <= 0.0) return 0.0;
    if (t >= seconds) return angle;
    if (t < ramp) return growth * t * t / 2.0;
    if (t > seconds - ramp) return angle - growth * (seconds - t) * (seconds - t) / 2.0;
    return rate * (t - ramp / 2.0);
  }

  double angle, growth, rate, ramp, seconds;  // [rad, rad/s^2, rad/s, s, s]
};

struct Halt {
  double distance;
  bool turns;
};

/// In driving order.
std::vector<Halt> halts_of(const DriveParams& params, double length) {
  std::vector<Halt> halts;
  for (int i = 0; i < params.stops; ++i) {
    halts.push_back({length * (i + 1) / (params.stops + 1), false});
  }
  for (int i = 0; i < params.turns_in_place; ++i) {
    halts.push_back({length * (i + 0.5) / params.turns_in_place, true});
  }
  std::stable_sort(halts.begin(), halts.end(),
                   [](const Halt& a, const Halt& b) { return a.distance < b.distance; });
  return halts;
}

}  // namespace

Pace::Pace(const DriveParams& params, double length)
    : speed_(params.speed),
      acceleration_(params.acceleration),
      turn_rate_(params.turn_rate * std::numbers::pi / 180.0),
      speed_now_(params.still_start > 0.0 ? 0.0 : params.speed) {
  rest(params.still_start);
  double side = 1.0;
  for (const Halt& halt : halts_of(params, length)) {
    halt_at(halt.distance);
    if (!halt.turns) {
      rest(params.stop_time);
      continue;
    }
    turn(0.0, side * kTurn);
    turn(side * kTurn, -side * kTurn);
    side = -side;
  }
  const double left = length - distance_;
  const double until_full = (speed_ - speed_now_) / acceleration_;
  if (until_full > 0.0) {
    const double way = (speed_ + speed_now_) / 2.0 * until_full;
    if (way > left) seconds_ = now_ + std::sqrt(2.0 * left / acceleration_);
    add({now_, distance_, speed_now_, acceleration_}, until_full);
  }
  if (seconds_ == 0.0) seconds_ = now_ + (length - distance_) / speed_;
  phases_.push_back({now_, distance_, speed_, 0.0});
}

void Pace::add(const Phase& phase, double seconds) {
  if (seconds <= 0.0) return;
  phases_.push_back(phase);
  now_ += seconds;
  distance_ += (phase.speed + phase.acceleration * seconds / 2.0) * seconds;
  speed_now_ = phase.speed + phase.acceleration * seconds;
}

void Pace::rest(double seconds) { add({now_, distance_, 0.0, 0.0}, seconds); }

void Pace::turn(double from, double angle) {
  add({now_, distance_, 0.0, 0.0, from, angle}, Turn(std::abs(angle), turn_rate_).seconds);
}

void Pace::halt_at(double distance) {
  const double way = distance - distance_;
  if (way <= 0.0) return;
  const double a = acceleration_;
  const double peak =
      std::clamp(std::sqrt(a * way + speed_now_ * speed_now_ / 2.0), speed_now_, speed_);
  add({now_, distance_, speed_now_, a}, (peak - speed_now_) / a);
  const double braking = std::min(peak * peak / (2.0 * a), distance - distance_);
  add({now_, distance_, peak, 0.0}, (distance - distance_ - braking) / peak);
  add({now_, distance_, peak, -peak * peak / (2.0 * braking)}, 2.0 * braking / peak);
  distance_ = distance;
  speed_now_ = 0.0;
}

const Pace::Phase& Pace::at(double seconds) const noexcept {
  const auto after = std::upper_bound(phases_.begin() + 1, phases_.end(), seconds,
                                      [](double t, const Phase& phase) { return t < phase.begin; });
  return *std::prev(after);
}

double Pace::distance(double seconds) const noexcept {
  const Phase& phase = at(seconds);
  const double t = seconds - phase.begin;
  return phase.distance + (phase.speed + phase.acceleration * t / 2.0) * t;
}

double Pace::turned(double seconds) const noexcept {
  const Phase& phase = at(seconds);
  if (phase.turn == 0.0) return phase.turned;
  const double angle = Turn(std::abs(phase.turn), turn_rate_).after(seconds - phase.begin);
  return phase.turned + std::copysign(angle, phase.turn);
}

double Pace::stopping_distance(const DriveParams& params) noexcept {
  return params.speed * params.speed / (2.0 * params.acceleration);
}

double Pace::first_halt(const DriveParams& params, double length) noexcept {
  const auto halts = halts_of(params, length);
  return halts.empty() ? length : halts.front().distance;
}

}  // namespace vantage::simulation
