#include "vantage/io/imu_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <system_error>
#include <utility>

#include "io/imu_text.hpp"
#include "io/ros/bag_imu.hpp"
#include "io/ros/message_reader.hpp"
#include "io/ros/topic_choice.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;
using Samples = std::span<const ImuSample>;

// What decides about units and rest. Chosen on data sheets: a MID-360 has biases of up to 0.075
// rad/s when hot, and noise of 0.001 rad/s and 0.01 m/s^2. Tested on a Phidgets IMU that lies
// still, on a Husky that drives, and on KITTI's car (imu_test.cpp).
constexpr double kStandardGravity = 9.80665;  // [m/s^2]
constexpr double kWindow = 1.0;               // in which a sensor is still or not [s]
constexpr std::size_t kFewest = 5;            // samples in a window that tells something
constexpr double kStillRate = 0.02;           // rms about the mean [rad/s]
constexpr double kStillForce = 0.05;          // rms about the mean, as a share of its length
constexpr double kLargestBias = 0.15;         // [rad/s]
constexpr double kShortestRest = 0.8;         // of a second at 10 Hz, 0.9 s are seen [s]
constexpr double kLongestRest = 10.0;         // [s]
constexpr double kPause = 2.0;                // median intervals
struct UnitRange {
  ForceUnit unit;
  double least, most;  // of the mean norm of the force
};
constexpr UnitRange kUnitRanges[] = {{ForceUnit::standard_gravity, 0.8, 1.2},
                                     {ForceUnit::metres_per_second_squared, 7.0, 12.0}};

/// Means of a window, and how far its samples are from them.
struct Window {
  Eigen::Vector3d rate = Eigen::Vector3d::Zero(), force = Eigen::Vector3d::Zero();
  double norm = 0.0;          // mean of the norms of the force
  double rate_spread = 0.0;   // rms [rad/s]
  double force_spread = 0.0;  // rms, as a share of the norm

  [[nodiscard]] double motion() const noexcept { return rate_spread + force_spread; }
  [[nodiscard]] bool is_still() const noexcept {
    return rate_spread <= kStillRate && force_spread <= kStillForce && rate.norm() <= kLargestBias;
  }
};

Window window_of(Samples samples) {
  Window window;
  const auto count = static_cast<double>(samples.size());
  for (const ImuSample& sample : samples) {
    window.rate += sample.angular_velocity / count;
    window.force += sample.specific_force / count;
    window.norm += sample.specific_force.norm() / count;
  }
  double rate = 0.0, force = 0.0;
  for (const ImuSample& sample : samples) {
    rate += (sample.angular_velocity - window.rate).squaredNorm() / count;
    force += (sample.specific_force - window.force).squaredNorm() / count;
  }
  window.rate_spread = std::sqrt(rate);
  window.force_spread =
      window.norm > 0.0 ? std::sqrt(force) / window.norm : std::numeric_limits<double>::infinity();
  return window;
}

/// The first samples, as many as there are within a second; at least one, however large its stamp.
Samples first_second(Samples samples) {
  const auto end = std::find_if(samples.begin(), samples.end(), [&](const ImuSample& sample) {
    return sample.stamp >= samples.front().stamp + kWindow;
  });
  return samples.first(std::max<std::size_t>(1, static_cast<std::size_t>(end - samples.begin())));
}

/// Calls visit(window, samples) for each second with enough samples until it returns false.
template <class Visit>
void for_each_second(Samples samples, const Visit& visit) {
  while (!samples.empty()) {
    const Samples second = first_second(samples);
    if (second.size() >= kFewest && !visit(window_of(second), second)) return;
    samples = samples.subspan(second.size());
  }
}

Window stillest_second(Samples samples) {
  std::optional<Window> stillest;
  for_each_second(samples, [&](const Window& window, Samples) {
    if (!stillest || window.motion() < stillest->motion()) stillest = window;
    return true;
  });
  return stillest ? *stillest : window_of(samples);
}

std::optional<ImuRest> rest_at_start(Samples samples) {
  std::size_t count = 0;
  std::optional<Window> first;
  for_each_second(samples, [&](const Window& window, Samples second) {
    const bool begins = second.data() == samples.data();
    if (!first && begins) first = window;
    if (!first || !window.is_still() || (window.rate - first->rate).norm() > kStillRate ||
        (window.force - first->force).norm() > kStillForce * first->norm) {
      return false;
    }
    count = static_cast<std::size_t>(second.data() + second.size() - samples.data());
    return samples[count - 1].stamp - samples.front().stamp < kLongestRest - kWindow;
  });
  const Samples still = samples.first(count);
  // A recording of less than a second says little about a bias.
  if (count < kFewest || still.back().stamp - still.front().stamp < kShortestRest) return {};
  const Window all = window_of(still);
  return ImuRest{.seconds = still.back().stamp - still.front().stamp,
                 .gyro_bias = all.rate,
                 .gravity = -all.force.normalized(),
                 .force = all.force.norm()};
}

/// Without pauses.
double mean_rate(Samples samples) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    intervals.push_back(samples[i].stamp - samples[i - 1].stamp);
  }
  if (intervals.empty()) return 0.0;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  const double longest = kPause * *middle;
  double sum = 0.0, count = 0.0;
  for (const double interval : intervals) {
    if (interval > longest) continue;
    sum += interval;
    count += 1.0;
  }
  return count / sum;
}

Result<ForceUnit> unit_of(double norm, const std::string& file) {
  for (const auto& [unit, least, most] : kUnitRanges) {
    if (norm >= least && norm <= most) return unit;
  }
  return fail(ErrorCode::corrupt_data,
              fmt::format("the acceleration has a mean norm of {:.4g} in the second in which the "
                          "sensor moves least, expected gravity: {} to {} (g) or {} to {} (m/s^2)",
                          norm, kUnitRanges[0].least, kUnitRanges[0].most, kUnitRanges[1].least,
                          kUnitRanges[1].most),
              SourceLocation{file, 0, 0});
}

/// Leaves out what cannot be used, in the order of the stamps.
void take_samples(ImuRecording& recording, RawImu raw) {
  recording.not_finite = raw.not_measured;
  double latest = -std::numeric_limits<double>::infinity();
  for (const ImuSample& sample : raw.samples) {
    if (!is_valid(sample)) {
      ++recording.not_finite;
      continue;
    }
    recording.out_of_order += sample.stamp < latest ? 1 : 0;
    latest = std::max(latest, sample.stamp);
    recording.samples.push_back(sample);
  }
  auto& samples = recording.samples;
  std::stable_sort(samples.begin(), samples.end(),
                   [](const ImuSample& a, const ImuSample& b) { return a.stamp < b.stamp; });
  const auto end =
      std::unique(samples.begin(), samples.end(),
                  [](const ImuSample& a, const ImuSample& b) { return a.stamp == b.stamp; });
  recording.duplicates = static_cast<std::uint64_t>(samples.end() - end);
  samples.erase(end, samples.end());
}

Result<ImuRecording> recording_of(RawImu raw, const fs::path& path, std::string topic) {
  ImuRecording recording;
  recording.source = topic.empty() ? path.string() : fmt::format("{} {}", path.string(), topic);
  recording.topic = std::move(topic);
  recording.frame = std::move(raw.frame);
  recording.stamp_rule = std::move(raw.stamp_rule);
  recording.damage = std::move(raw.damage);
  take_samples(recording, std::move(raw));
  if (recording.samples.empty()) {
    return fail(ErrorCode::corrupt_data,
                fmt::format("no inertial sample{}, expected at least one{}",
                            recording.topic.empty() ? "" : " of " + recording.topic,
                            recording.not_finite > 0
                                ? fmt::format(" ({} left out that are not finite or without a "
                                              "quantity or stamp)",
                                              recording.not_finite)
                                : ""),
                SourceLocation{path.string(), 0, 0});
  }
  recording.still_force = stillest_second(recording.samples).norm;
  VANTAGE_TRY(recording.unit, unit_of(recording.still_force, path.string()));
  if (recording.unit == ForceUnit::standard_gravity) {
    for (ImuSample& sample : recording.samples) sample.specific_force *= kStandardGravity;
  }
  recording.rate_hz = mean_rate(recording.samples);
  recording.rest = rest_at_start(recording.samples);
  return recording;
}

bool is_folder(const fs::path& path) noexcept {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

Result<ImuRecording> read_bag(const ImuSource& source) {
  VANTAGE_TRY(const auto reader, ros::open_bag(source.path));
  VANTAGE_TRY(const auto topics, ros::choose_topic(*reader, source.topic, ros::imu_needed()));
  const std::string topic = reader->topics()[topics.front()].name;
  VANTAGE_TRY(auto raw, ros::read_bag_imu(*reader, topics));
  return recording_of(std::move(raw), source.path, topic);
}

}  // namespace

std::string_view to_string(ForceUnit unit) noexcept {
  return unit == ForceUnit::standard_gravity ? "g" : "m/s^2";
}

Result<ImuRecording> read_imu(const ImuSource& source) {
  const auto error = [&](std::string message) {
    return fail(ErrorCode::invalid_input, std::move(message),
                SourceLocation{source.path.string(), 0, 0});
  };
  std::error_code ignored;
  if (!fs::exists(source.path, ignored)) {
    return fail(ErrorCode::not_found,
                fmt::format("no such file or directory, expected inertial samples ({})",
                            format_names(FormatUse::imu)),
                SourceLocation{source.path.string(), 0, 0});
  }
  const bool is_oxts = looks_like_oxts(source.path);
  if (source.frame_rate_hz && !is_oxts) {
    return error("has stamps of its own; only those of KITTI's oxts can be frame numbers");
  }
  VANTAGE_TRY(const bool bag, ros::is_bag(source.path));
  if (bag) return read_bag(source);
  if (!source.topic.empty()) return error("only bags have topics, so none can be chosen");
  if (is_oxts) {
    VANTAGE_TRY(auto raw, read_oxts(source.path, source.frame_rate_hz));
    return recording_of(std::move(raw), source.path, {});
  }
  if (is_folder(source.path)) {
    return error("is neither a bag nor KITTI's oxts, which has a folder data and timestamps.txt");
  }
  VANTAGE_TRY(
      const auto content,
      read_file(source.path, fmt::format("inertial samples ({})", format_names(FormatUse::imu))));
  VANTAGE_TRY(auto raw, parse_imu_csv(content.view(), source.path.string()));
  return recording_of(std::move(raw), source.path, {});
}

bool is_imu(const fs::path& path) {
  if (is_folder(path)) return looks_like_oxts(path);
  constexpr std::size_t kHead = 4096;  // [bytes]; enough for a line of names
  const auto file = InputFile::open(path, "inertial samples");
  if (!file) return false;
  std::string head(std::min(file->size(), kHead), '\0');
  return file->read(0, head).has_value() && looks_like_imu_csv(head);
}

}  // namespace vantage::io
