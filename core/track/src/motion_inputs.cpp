#include "vantage/track/motion_inputs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace vantage {
namespace {

// A sensor that is silent for longer than this says nothing of the time in between [s]. Odometry
// may be slower: its gaps are so many times as long as its usual interval.
constexpr double kLongestGap = 0.25;
constexpr double kGapIntervals = 2.5;
// That interval is the median of so many: a pause or a burst is not the usual case.
constexpr std::size_t kIntervals = 7;
// The last sample holds for this long [s].
constexpr double kHold = 0.1;
// A body that nothing has measured for this long may have stopped [s].
constexpr double kCoasting = 10.0;
// Samples are held for this long, even if no scan uses them [s].
constexpr double kLongest = 60.0;

/// Inserts a sample by its stamp. A stamp that is far from those before and after it is wrong; far
/// back, two stamps in a row say that the clock was set back.
/// @param far_back  the last stamp that was, until one is not
/// @return  how many samples were dropped: that one if there is one with its stamp or if it is far
///          back, and those that are far ahead of it
template <class Sample>
std::uint64_t insert(std::deque<Sample>& samples, const Sample& sample,
                     std::optional<double>& far_back) {
  const auto is_ahead = [&](const Sample& s) { return s.stamp > sample.stamp + kLongest; };
  if (samples.size() > 1 && is_ahead(*std::prev(samples.end(), 2))) {
    const auto before = std::exchange(far_back, sample.stamp);
    if (!before || std::abs(sample.stamp - *before) > kLongest || sample.stamp == *before) return 1;
  }
  far_back.reset();
  std::uint64_t dropped = 0;
  for (; !samples.empty() && is_ahead(samples.back()); ++dropped) samples.pop_back();
  const auto at = std::lower_bound(samples.begin(), samples.end(), sample.stamp,
                                   [](const Sample& s, double stamp) { return s.stamp < stamp; });
  if (at != samples.end() && at->stamp == sample.stamp) return dropped + 1;
  samples.insert(at, sample);
  // The last stamp may be a wrong one, which drops no others.
  while (samples.size() > 2 &&
         samples.front().stamp < std::prev(samples.end(), 2)->stamp - kLongest) {
    samples.pop_front();
  }
  return dropped;
}

/// The first sample later than a moment.
template <class Sample>
auto later_than(const std::deque<Sample>& samples, double stamp) {
  return std::upper_bound(samples.begin(), samples.end(), stamp,
                          [](double t, const Sample& s) { return t < s.stamp; });
}

/// Drops samples that are not needed from a moment on; one before it stays, to interpolate from.
template <class Sample>
void drop_before(std::deque<Sample>& samples, double stamp) {
  while (samples.size() > 1 && samples[1].stamp <= stamp) samples.pop_front();
}

ImuSample mean_of(const ImuSample& a, const ImuSample& b, double stamp) {
  const double share = (stamp - a.stamp) / (b.stamp - a.stamp);
  return {
      .stamp = stamp,
      .angular_velocity = a.angular_velocity + share * (b.angular_velocity - a.angular_velocity),
      .specific_force = a.specific_force + share * (b.specific_force - a.specific_force)};
}

}  // namespace

Result<void> MotionInputs::add(const ImuSample& sample) {
  if (!is_valid(sample)) {
    return fail(ErrorCode::invalid_input, "an IMU sample at " + std::to_string(sample.stamp) +
                                              " s has a number that is not finite or possible");
  }
  const bool late = forgotten_ && sample.stamp <= *forgotten_;
  dropped_ += late ? 1 : insert(imu_, sample, imu_far_back_);
  return {};
}

Result<void> MotionInputs::add(const OdometrySample& sample) {
  if (!is_valid(sample)) {
    return fail(ErrorCode::invalid_input,
                "the odometry at " + std::to_string(sample.stamp) +
                    " s is not a rigid transform, or is farther away than 1e8 m");
  }
  const Pose T_body_imu = mounts_.T_sensor_body.inverse() * mounts_.T_sensor_imu;
  const bool late = forgotten_ && sample.stamp <= *forgotten_;
  const double newest =
      odometry_.empty() ? std::numeric_limits<double>::infinity() : odometry_.back().stamp;
  dropped_ +=
      late ? 1
           : insert(odometry_, {sample.stamp, sample.T_odom_body * T_body_imu}, odometry_far_back_);
  if (odometry_.back().stamp > newest) learn_interval(odometry_.back().stamp - newest);
  return {};
}

void MotionInputs::learn_interval(double last) {
  last_intervals_.push_back(last);
  if (last_intervals_.size() > kIntervals) last_intervals_.pop_front();
  std::vector<double> sorted(last_intervals_.begin(), last_intervals_.end());
  const auto median = sorted.begin() + std::ssize(sorted) / 2;
  std::nth_element(sorted.begin(), median, sorted.end());
  odometry_interval_ = *median;
}

std::optional<MotionInputs::MeanTwist> MotionInputs::mean_until(Sample next) const {
  constexpr double kFastestDrive = 100.0, kFastestSpin = 30.0;  // [m/s], [rad/s]
  if (next == odometry_.begin() || next == odometry_.end()) return {};
  const Odometry& last = *std::prev(next);
  MeanTwist mean{.twist = logarithm(last.T_odom_imu.inverse() * next->T_odom_imu),
                 .middle = 0.5 * (last.stamp + next->stamp),
                 .seconds = next->stamp - last.stamp};
  if (mean.seconds > std::max(kLongestGap, kGapIntervals * odometry_interval_)) return {};
  mean.twist.linear /= mean.seconds;
  mean.twist.angular /= mean.seconds;
  const bool possible =
      mean.twist.linear.norm() < kFastestDrive && mean.twist.angular.norm() < kFastestSpin;
  return possible ? std::optional(mean) : std::nullopt;
}

Twist MotionInputs::mean_around(double stamp, Sample next) const {
  Sample first = std::prev(next), last = next;
  while (last->stamp - first->stamp < MotionInput::kSteady) {
    const bool later = mean_until(last + 1).has_value(), earlier = mean_until(first).has_value();
    if (!later && !earlier) break;
    if (later && (!earlier || last->stamp - stamp <= stamp - first->stamp)) {
      ++last;
    } else {
      --first;
    }
  }
  const Twist step = logarithm(first->T_odom_imu.inverse() * last->T_odom_imu);
  const double seconds = last->stamp - first->stamp;
  return {.linear = step.linear / seconds, .angular = step.angular / seconds};
}

MotionInput MotionInputs::at(double from, double to, double silent_since) const {
  const double middle = 0.5 * (from + to);
  MotionInput input{.seconds = to - from};
  if (const auto next = later_than(imu_, middle); next != imu_.begin()) {
    const ImuSample& last = *std::prev(next);
    std::optional<ImuSample> sample;
    if (next != imu_.end() && next->stamp - last.stamp <= kLongestGap) {
      sample = mean_of(last, *next, middle);
    } else if (next == imu_.end() && middle - last.stamp <= kHold) {
      sample = last;
    }
    if (sample) {
      input.rate = sample->angular_velocity;
      input.force = sample->specific_force;
    }
  }
  const Sample next = later_than(odometry_, middle);
  if (const auto mean = mean_until(next)) {
    input.odometry = mean->twist;
    input.odometry_seconds = mean->seconds;
    // From the middle of one mean to that of another, the twist changes evenly.
    if (const auto other = mean_until(middle > mean->middle ? next + 1 : next - 1)) {
      const double share = (middle - mean->middle) / (other->middle - mean->middle);
      input.odometry->linear += share * (other->twist.linear - mean->twist.linear);
      input.odometry->angular += share * (other->twist.angular - mean->twist.angular);
    }
    input.steady_odometry =
        mean->seconds < MotionInput::kSteady ? mean_around(middle, next) : *input.odometry;
  }
  input.coasts = !input.rate && !input.odometry && middle > silent_since + kCoasting;
  return input;
}

std::vector<MotionInput> MotionInputs::between(double from, double to, double silent_since) const {
  constexpr double kLongestStep = 0.02;  // [s]; the filter's steps are of first order
  constexpr double kMostSteps = 500.0;   // of a long pause
  const double begin = std::min(from, to), end = std::max(from, to);
  std::vector<double> cuts{begin};
  const auto cut_at = [&](const auto& samples) {
    for (auto s = later_than(samples, begin); s != samples.end() && s->stamp < end; ++s) {
      cuts.push_back(s->stamp);
    }
  };
  cut_at(imu_);
  cut_at(odometry_);
  cuts.push_back(end);
  std::sort(cuts.begin(), cuts.end());
  std::vector<MotionInput> inputs;
  const double longest = std::max(kLongestStep, (end - begin) / kMostSteps);
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    const double seconds = cuts[k + 1] - cuts[k];
    if (!(seconds > 0.0)) continue;
    const auto steps = static_cast<std::size_t>(std::ceil(seconds / longest - 1e-9));
    const auto begin_of = [&](std::size_t step) {
      return cuts[k] + static_cast<double>(step) / static_cast<double>(steps) * seconds;
    };
    for (std::size_t step = 0; step < steps; ++step) {
      inputs.push_back(at(begin_of(step), begin_of(step + 1), silent_since));
    }
  }
  if (to < from) {
    std::reverse(inputs.begin(), inputs.end());
    for (MotionInput& input : inputs) input.seconds = -input.seconds;
  }
  return inputs;
}

std::optional<MotionInputs::Rest> MotionInputs::rest(double until) const {
  constexpr double kShortest = 0.5;               // [s]
  constexpr double kTurns = 0.01, kShakes = 0.2;  // standard deviations [rad/s, m/s^2]
  constexpr double kFastest = 0.2;                // [rad/s]; of a bias
  const auto end = later_than(imu_, until);
  if (end == imu_.begin() || std::prev(end)->stamp - imu_.front().stamp < kShortest) return {};
  const auto n = static_cast<double>(end - imu_.begin());
  Rest mean;
  for (auto s = imu_.begin(); s != end; ++s) {
    mean.rate += s->angular_velocity / n;
    mean.force += s->specific_force / n;
  }
  double turns = 0.0, shakes = 0.0;
  for (auto s = imu_.begin(); s != end; ++s) {
    turns += (s->angular_velocity - mean.rate).squaredNorm() / n;
    shakes += (s->specific_force - mean.force).squaredNorm() / n;
  }
  if (std::sqrt(turns) > kTurns || std::sqrt(shakes) > kShakes || mean.rate.norm() > kFastest) {
    return {};
  }
  return mean;
}

std::optional<Eigen::Vector3d> MotionInputs::up(double stamp) const {
  constexpr double kRecent = 0.5;  // [s]
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (auto s = later_than(imu_, stamp - kRecent); s != imu_.end() && s->stamp <= stamp; ++s) {
    sum += s->specific_force;
  }
  if (!(sum.norm() > 0.0)) return {};
  return mounts_.T_sensor_imu.rotation.toRotationMatrix() * sum.normalized();
}

void MotionInputs::forget() {
  imu_.clear();
  odometry_.clear();
  last_intervals_.clear();
  odometry_interval_ = 0.0;
  imu_far_back_.reset();
  odometry_far_back_.reset();
  forgotten_.reset();
}

void MotionInputs::forget_before(double stamp) {
  forgotten_ = forgotten_ ? std::max(*forgotten_, stamp) : stamp;
  drop_before(imu_, stamp - 1.0);
  drop_before(odometry_, stamp - 1.0);
}

}  // namespace vantage
