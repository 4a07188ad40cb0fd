#include "vantage/evaluation/clock_offset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "vantage/evaluation/statistics.hpp"

namespace vantage {
namespace {

// So much of the turns lies within the samples of the IMU, at an offset that counts.
constexpr double kCovered = 0.8;

/// How fast the sensor turned between two poses.
struct Turn {
  double begin, end;  // [s]
  double rate;        // [rad/s]
};

std::vector<Turn> turns_of(const io::Trajectory& poses) {
  constexpr double kLongest = 0.5;  // [s]; a mean over more says little
  std::vector<Turn> turns;
  for (std::size_t k = 0; k + 1 < poses.size(); ++k) {
    const double seconds = poses[k + 1].stamp - poses[k].stamp;
    if (!(seconds > 0.0 && seconds <= kLongest)) continue;
    turns.push_back({poses[k].stamp, poses[k + 1].stamp,
                     rotation_between(poses[k].pose, poses[k + 1].pose) / seconds});
  }
  return turns;
}

/// The rotation that the gyroscope adds up over any time.
class GyroIntegral {
 public:
  explicit GyroIntegral(const std::vector<ImuSample>& samples) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < samples.size(); ++k) {
      if (k > 0) {
        sum += 0.5 * (samples[k].stamp - samples[k - 1].stamp) *
               (samples[k].angular_velocity + samples[k - 1].angular_velocity);
      }
      stamps_.push_back(samples[k].stamp);
      sums_.push_back(sum);
    }
  }
  [[nodiscard]] bool covers(double begin, double end) const {
    return begin >= stamps_.front() && end <= stamps_.back();
  }
  /// The size of the mean rate of turn [rad/s]. Precondition: covers the time.
  [[nodiscard]] double mean_rate(double begin, double end) const {
    return (at(end) - at(begin)).norm() / (end - begin);
  }

 private:
  [[nodiscard]] Eigen::Vector3d at(double stamp) const {
    const auto later = std::upper_bound(stamps_.begin(), stamps_.end(), stamp);
    if (later == stamps_.end()) return sums_.back();
    const auto k = static_cast<std::size_t>(later - stamps_.begin());
    const double share = (stamp - stamps_[k - 1]) / (stamps_[k] - stamps_[k - 1]);
    return sums_[k - 1] + share * (sums_[k] - sums_[k - 1]);
  }

  std::vector<double> stamps_;
  std::vector<Eigen::Vector3d> sums_;
};

/// Of the turns with those of the gyroscope, whose stamps are moved by an offset; -1 where too few
/// are covered.
double correlation_at(double offset, const std::vector<Turn>& turns, const GyroIntegral& gyro) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
  for (const Turn& turn : turns) {
    const double begin = turn.begin - offset, end = turn.end - offset;
    if (!gyro.covers(begin, end)) continue;
    const double rate = gyro.mean_rate(begin, end);
    n += 1.0;
    x += turn.rate;
    y += rate;
    xx += turn.rate * turn.rate;
    yy += rate * rate;
    xy += turn.rate * rate;
  }
  if (n < kCovered * static_cast<double>(turns.size())) return -1.0;
  const double varied = (xx - x * x / n) * (yy - y * y / n);
  return varied > 0.0 ? (xy - x * y / n) / std::sqrt(varied) : -1.0;
}

/// Offsets in a range, in even steps, with their correlations.
std::vector<ClockOffset> offsets(double from, double to, double step,
                                 const std::vector<Turn>& turns, const GyroIntegral& gyro) {
  std::vector<ClockOffset> all;
  const auto steps = static_cast<std::size_t>(std::ceil((to - from) / step));
  for (std::size_t k = 0; k <= steps; ++k) {
    const double offset = from + static_cast<double>(k) * step;
    all.push_back({offset, correlation_at(offset, turns, gyro)});
  }
  return all;
}

ClockOffset best_of(const std::vector<ClockOffset>& all) {
  return *std::ranges::max_element(all, {}, &ClockOffset::correlation);
}

double deviation_of(const std::vector<Turn>& turns) {
  std::vector<double> rates;
  for (const Turn& turn : turns) rates.push_back(turn.rate);
  return statistics_of(rates).std;
}

}  // namespace

Result<ClockOffset> clock_offset_of(const io::Trajectory& poses, const io::ImuRecording& imu) {
  constexpr std::size_t kFewest = 30;
  constexpr double kLeastTurning = 0.03;  // [rad/s]
  constexpr double kLeastCorrelation = 0.8;
  constexpr double kCoarse = 0.02, kFine = 0.0005;  // [s]
  constexpr double kApart = 1.0, kClear = 0.05;     // [s]; another offset is clearly worse
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::invalid_input,
                "the clock of the IMU cannot be compared with the scans: " + why,
                SourceLocation{imu.source, 0, 0});
  };
  const std::vector<Turn> turns = turns_of(poses);
  if (turns.size() < kFewest || imu.samples.size() < kFewest) {
    return refuse(
        fmt::format("{} tracked scans follow one another and there are {} samples, "
                    "expected at least {} of each",
                    turns.size(), imu.samples.size(), kFewest));
  }
  if (const double turning = deviation_of(turns); turning < kLeastTurning) {
    return refuse(
        fmt::format("the sensor's rate of turn changes by {:.3f} rad/s, expected at "
                    "least {}; choose a part of the recording with turns (--start)",
                    turning, kLeastTurning));
  }
  const GyroIntegral gyro(imu.samples);
  const double whole = turns.back().end - turns.front().begin;
  const double first = turns.back().end - imu.samples.back().stamp - (1.0 - kCovered) * whole;
  const double last = turns.front().begin - imu.samples.front().stamp + (1.0 - kCovered) * whole;
  if (first > last) {
    return refuse(fmt::format("its samples cover {:.1f} s, and the poses {:.1f} s",
                              imu.samples.back().stamp - imu.samples.front().stamp, whole));
  }
  const std::vector<ClockOffset> all = offsets(first, last, kCoarse, turns, gyro);
  const ClockOffset coarse = best_of(all);
  const ClockOffset found =
      best_of(offsets(coarse.seconds - kCoarse, coarse.seconds + kCoarse, kFine, turns, gyro));
  if (found.correlation < kLeastCorrelation) {
    return refuse(
        fmt::format("its turns resemble those of the poses by {:.2f} at best, expected "
                    "at least {}",
                    found.correlation, kLeastCorrelation));
  }
  for (const ClockOffset& other : all) {
    if (std::abs(other.seconds - found.seconds) < kApart ||
        other.correlation < found.correlation - kClear) {
      continue;
    }
    return refuse(
        fmt::format("its turns resemble those of the poses as much at {:+.2f} s ({:.2f}) "
                    "as at {:+.2f} s ({:.2f}); give the offset",
                    other.seconds, other.correlation, found.seconds, found.correlation));
  }
  return found;
}

Result<ClockOffset> measure_clock_offset(Localizer localizer, const RunInputs& inputs) {
  constexpr double kLongest = 60.0;  // [s]
  if (!inputs.imu) return fail(ErrorCode::invalid_input, "there is no IMU whose clock to compare");
  RunInputs without = inputs;
  without.imu.reset();
  without.speed.reset();
  if (without.priors && !without.initial_pose) without.start_anywhere = true;
  without.priors.reset();  // they may begin later
  without.window.duration = std::min(kLongest, inputs.window.duration.value_or(kLongest));
  io::Trajectory poses;
  const auto keep = [&](const io::StampedScan&, const RunScan& scan) -> Result<void> {
    if (is_tracked(scan)) poses.push_back({scan.report.stamp, scan.report.T_map_scan});
    return {};
  };
  VANTAGE_TRY(const RunInfo info, localize_each(std::move(localizer), "", without, keep));
  if (info.failure) return fail(Error(*info.failure));
  return clock_offset_of(poses, *inputs.imu);
}

}  // namespace vantage
