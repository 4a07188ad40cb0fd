#include "vantage/evaluation/clock_offset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "vantage/evaluation/statistics.hpp"

namespace vantage {
namespace {

// So much of the turns lies within the samples of the IMU, at an offset that counts.
constexpr double kCovered = 0.8;
// Over a longer time, a mean rate of turn says little [s].
constexpr double kLongest = 0.5;

/// How fast the sensor turned between two poses.
struct Turn {
  double begin, end;  // [s]
  double rate;        // [rad/s]
};

std::vector<Turn> turns_of(const io::Trajectory& poses) {
  std::vector<Turn> turns;
  for (std::size_t k = 0; k + 1 < poses.size(); ++k) {
    const double seconds = poses[k + 1].stamp - poses[k].stamp;
    if (!(seconds > 0.0 && seconds <= kLongest)) continue;
    turns.push_back({poses[k].stamp, poses[k + 1].stamp,
                     rotation_between(poses[k].pose, poses[k + 1].pose) / seconds});
  }
  return turns;
}

/// The rotation that the gyroscope adds up over any time without a gap. Gaps also separate samples
/// with stray stamps from the others.
class GyroIntegral {
 public:
  /// Samples without a gap.
  struct Piece {
    std::size_t first, last;  // at least two samples
    double begin, end;        // [s]
    double before;            // how long the pieces before are [s]
  };

  explicit GyroIntegral(const std::vector<ImuSample>& samples) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t first = 0;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const double seconds = k > 0 ? samples[k].stamp - samples[k - 1].stamp : 0.0;
      if (seconds > kLongest) {
        add_piece(first);
        first = k;
      } else if (k > 0) {
        sum += 0.5 * seconds * (samples[k].angular_velocity + samples[k - 1].angular_velocity);
      }
      stamps_.push_back(samples[k].stamp);
      sums_.push_back(sum);
    }
    add_piece(first);
  }

  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }
  /// How much of a time the samples cover [s].
  [[nodiscard]] double covered(double begin, double end) const {
    return covered_before(end) - covered_before(begin);
  }
  /// How much they cover at all [s].
  [[nodiscard]] double covered() const {
    return pieces_.empty() ? 0.0 : covered_before(pieces_.back().end);
  }
  /// The size of the mean rate of turn [rad/s]; nothing unless samples cover the whole time.
  [[nodiscard]] std::optional<double> mean_rate(double begin, double end) const {
    const Piece* piece = last_piece_from(begin);
    if (piece == nullptr || end > piece->end) return std::nullopt;
    return (at(*piece, end) - at(*piece, begin)).norm() / (end - begin);
  }

 private:
  void add_piece(std::size_t first) {
    if (stamps_.size() < first + 2) return;
    pieces_.push_back({.first = first,
                       .last = stamps_.size() - 1,
                       .begin = stamps_[first],
                       .end = stamps_.back(),
                       .before = covered()});
  }
  /// The last piece that has begun.
  [[nodiscard]] const Piece* last_piece_from(double stamp) const {
    const auto later = std::ranges::upper_bound(pieces_, stamp, {}, &Piece::begin);
    return later == pieces_.begin() ? nullptr : &*std::prev(later);
  }
  [[nodiscard]] double covered_before(double stamp) const {
    const Piece* piece = last_piece_from(stamp);
    return piece == nullptr ? 0.0 : piece->before + std::min(stamp, piece->end) - piece->begin;
  }
  [[nodiscard]] Eigen::Vector3d at(const Piece& piece, double stamp) const {
    const auto index = [](std::size_t k) { return static_cast<std::ptrdiff_t>(k); };
    const auto end = stamps_.begin() + index(piece.last + 1);
    const auto later = std::upper_bound(stamps_.begin() + index(piece.first), end, stamp);
    if (later == end) return sums_[piece.last];
    const auto k = static_cast<std::size_t>(later - stamps_.begin());
    const double share = (stamp - stamps_[k - 1]) / (stamps_[k] - stamps_[k - 1]);
    return sums_[k - 1] + share * (sums_[k] - sums_[k - 1]);
  }

  std::vector<double> stamps_;
  std::vector<Eigen::Vector3d> sums_;
  std::vector<Piece> pieces_;  // in the order of time
};

/// Of the turns with those of the gyroscope, whose stamps are moved by an offset; -1 where too few
/// are covered.
double correlation_at(double offset, const std::vector<Turn>& turns, const GyroIntegral& gyro) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
  for (const Turn& turn : turns) {
    const auto rate = gyro.mean_rate(turn.begin - offset, turn.end - offset);
    if (!rate) continue;
    n += 1.0;
    x += turn.rate;
    y += *rate;
    xx += turn.rate * turn.rate;
    yy += *rate * *rate;
    xy += turn.rate * *rate;
  }
  if (n < kCovered * static_cast<double>(turns.size())) return -1.0;
  const double varied = (xx - x * x / n) * (yy - y * y / n);
  return varied > 0.0 ? (xy - x * y / n) / std::sqrt(varied) : -1.0;
}

/// Calls f with the offsets of a range, in even steps.
template <class F>
void for_each_offset(double from, double to, double step, const F& f) {
  const auto steps = static_cast<std::size_t>(std::max(0.0, std::ceil((to - from) / step)));
  for (std::size_t k = 0; k <= steps; ++k) f(from + static_cast<double>(k) * step);
}

/// Calls f with the offsets at which the samples cover most of the time of the turns, once each.
/// The steps go through the times of each piece of the recording, not through the gaps, which may
/// last for decades.
template <class F>
void for_each_covering(double step, const std::vector<Turn>& turns, const GyroIntegral& gyro,
                       const F& f) {
  const double begin = turns.front().begin, end = turns.back().end;
  double tried = std::numeric_limits<double>::infinity();  // all offsets from here on [s]
  for (const GyroIntegral::Piece& piece : gyro.pieces()) {
    const double from = begin - piece.end, to = std::min(tried, end - piece.begin);
    tried = from;
    for_each_offset(from, to, step, [&](double offset) {
      if (gyro.covered(begin - offset, end - offset) >= kCovered * (end - begin)) f(offset);
    });
  }
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
  std::optional<ClockOffset> coarse;
  std::vector<ClockOffset> alike;
  for_each_covering(kCoarse, turns, gyro, [&](double offset) {
    const ClockOffset tried{offset, correlation_at(offset, turns, gyro)};
    if (!coarse || tried.correlation > coarse->correlation) coarse = tried;
    if (tried.correlation >= kLeastCorrelation - kClear) alike.push_back(tried);
  });
  if (!coarse) {
    return refuse(
        fmt::format("at no offset are most of the poses within its samples, which cover {:.1f} s; "
                    "the poses cover {:.1f} s",
                    gyro.covered(), turns.back().end - turns.front().begin));
  }
  ClockOffset found = *coarse;
  for_each_offset(coarse->seconds - kCoarse, coarse->seconds + kCoarse, kFine, [&](double offset) {
    const ClockOffset tried{offset, correlation_at(offset, turns, gyro)};
    if (tried.correlation > found.correlation) found = tried;
  });
  if (found.correlation < kLeastCorrelation) {
    return refuse(
        fmt::format("its turns resemble those of the poses by {:.2f} at best, expected "
                    "at least {}",
                    found.correlation, kLeastCorrelation));
  }
  for (const ClockOffset& other : alike) {
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
  constexpr double kMeasured = 60.0;  // [s]
  if (!inputs.imu) return fail(ErrorCode::invalid_input, "there is no IMU whose clock to compare");
  RunInputs without = inputs;
  without.imu.reset();
  without.speed.reset();
  if (without.priors && !without.initial_pose) without.start_anywhere = true;
  without.priors.reset();  // they may begin later
  without.window.duration = std::min(kMeasured, inputs.window.duration.value_or(kMeasured));
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
