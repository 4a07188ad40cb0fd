#include "live/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "vantage/track/rotation.hpp"

namespace vantage::live {
namespace {

using io::ros::frame_name;

// A source of motion that has been silent for longer than this is not waited for, nor is one that
// has not spoken for the time after the first scan [s].
constexpr double kSilent = 1.0, kFirstWord = 5.0;
// Without a scan for longer than this, scans are said to be missing [s].
constexpr double kNoScan = 2.0;

double seconds_between(std::int64_t from, std::int64_t to) {  // of [ns]
  return static_cast<double>(to - from) * 1e-9;
}

}  // namespace

Session::Session(Localizer localizer, LiveParams params, const std::optional<Pose>& kept,
                 Notices& notices, std::optional<io::MapProjection> projection)
    : localizer_(std::move(localizer)),
      params_(std::move(params)),
      notices_(notices),
      priors_(params_, std::move(projection), notices),
      requests_(params_.frames.map, notices),
      last_(kept) {
  begin_anew("");
}

/// From the last pose that was tracked, or as the configuration says.
void Session::begin_anew(const std::string& why) {
  if (!why.empty()) notices_.say(why);
  is_started_ = false;
  first_stamp_.reset();
  last_stamp_.reset();
  last_imu_.reset();
  last_odometry_.reset();
  imu_.clear();
  odometry_.clear();
  priors_.forget();
  fed_odometry_ = 0;
  if (last_) {
    const auto started = localizer_.start(*last_);
    if (started) {
      is_started_ = true;
      return;
    }
    const bool may_return = started.error().code == ErrorCode::io_failure;  // a disk that is slow
    notices_.say(fmt::format("cannot begin at the last pose, which is {}: {}",
                             may_return ? "kept" : "forgotten", to_string(started.error())));
    if (!may_return) last_.reset();
  }
  if (params_.start == Start::wait && !priors_.has_hint()) return;
  begin_anywhere();
}

void Session::begin_anywhere() {
  localizer_.start_anywhere();
  is_started_ = true;
}

/// Several scans may wait for their samples. Scans come faster than they are localized if the
/// oldest could be localized when the newest can be, or when the second has waited its time.
void Session::drop_overdue() {
  constexpr std::size_t kMostWaiting = 16;
  const std::int64_t now = waiting_.back().received.arrival;
  while (waiting_.size() > 1) {
    const bool overdue = is_ready(waiting_.front(), now) && is_ready(waiting_.back(), now);
    const bool second_waited =
        seconds_between(waiting_[1].received.arrival, now) >= params_.motion_wait;
    if (!overdue && !second_waited && waiting_.size() <= kMostWaiting) return;
    waiting_.pop_front();
    notices_.tell_dropped_scans();
  }
}

bool Session::has_motion(const Waiting& scan) const {
  const auto covers = [&](const std::string& topic, const std::optional<double>& last) {
    if (topic.empty()) return true;
    if (!last) return scan.end > *first_stamp_ + kFirstWord;
    return *last >= scan.end || *last < scan.end - kSilent;
  };
  return covers(params_.topics.imu, last_imu_) && covers(params_.topics.odometry, last_odometry_);
}

/// Whether a scan has waited for its samples long enough.
bool Session::has_waited(const Waiting& scan, std::int64_t now) const {
  return seconds_between(scan.received.arrival, now) >= params_.motion_wait;
}

/// A source of motion may be silent, or its clock another one: it is then not waited for.
void Session::tell_silent_motion(const Waiting& scan, bool has_odometry) {
  if (scan.end <= *first_stamp_ + kFirstWord) return;
  if (!params_.topics.odometry.empty() && !has_odometry) {
    notices_.tell("scans_without_odometry",
                  fmt::format("no pose of {} belongs to a scan: /tf gets no transform from {} to "
                              "the odometry; it may be silent, or have another clock",
                              params_.topics.odometry, params_.frames.map));
  }
  const bool has_imu = last_imu_ && *last_imu_ >= scan.end - kSilent;
  if (!params_.topics.imu.empty() && !has_imu) {
    notices_.tell("scans_without_imu",
                  fmt::format("no sample of {} belongs to a scan: it may be silent, or have "
                              "another clock",
                              params_.topics.imu));
  }
}

/// T_base_sensor of a frame. Errors: `invalid_input` if it is not known.
Result<Pose> Session::mount(const std::string& frame) const {
  if (const auto given = params_.frames.mount()) return *given;
  auto found = frames_.pose(params_.frames.base, frame);
  if (found && *found) return **found;
  return fail(
      ErrorCode::invalid_input,
      fmt::format("scans are in the frame '{}', and {}: they are left out; publish /tf_static or "
                  "give [live.frames] T_base_sensor",
                  frame,
                  found ? fmt::format("no transform leads from '{}' to it", params_.frames.base)
                        : found.error().message));
}

std::optional<Idle> Session::idle(std::int64_t until,
                                  const std::vector<std::string>& obstacles) const {
  using Level = io::ros::Diagnostic::Level;
  std::optional<Idle> idle;
  const auto add = [&](Level level, const std::string& why) {
    if (!idle) {
      idle = Idle{.level = level, .message = why};
      return;
    }
    idle->level = std::max(idle->level, level);
    idle->message += "; " + why;
  };
  const TopicParams& topics = params_.topics;
  if (!requests_.wants_scan()) add(Level::warn, "switched off by its service");
  if (!is_started_) add(Level::warn, fmt::format("waits for a pose on {}", topics.initial_pose));
  if (left_out_) add(Level::error, *left_out_);
  if (!scan_came_) {
    add(Level::stale, fmt::format("no scan has come on {} yet", topics.points));
  } else if (const double silent = seconds_between(*scan_came_, until); silent > kNoScan) {
    add(Level::stale, fmt::format("no scan has come on {} for {:.0f} s", topics.points, silent));
  }
  if (!idle) return idle;
  for (const std::string& one : obstacles) add(idle->level, one);
  return idle;
}

void Session::feed_imu() {
  for (const ImuSample& sample : imu_) {
    if (!localizer_.add(sample)) notices_.count("imu_unusable");
  }
  imu_.clear();
}

std::optional<Moved> Session::moved() {
  constexpr double kAfterScan = 1.0;  // [s]
  const auto stamp = std::exchange(moved_, std::nullopt);
  if (!requests_.is_on() || !stamp || !T_base_sensor_ || !last_stamp_ ||
      *stamp > *last_stamp_ + kAfterScan) {
    return std::nullopt;
  }
  feed_imu();
  const auto motion = localizer_.motion_at(*stamp);
  if (!motion) return std::nullopt;
  return Moved{.stamp = *stamp, .motion = *motion, .T_base_sensor = *T_base_sensor_};
}

/// Gives the localizer the samples that came since the scan before.
void Session::feed_motion(const std::string& sensor) {
  feed_imu();
  for (; fed_odometry_ < odometry_.size(); ++fed_odometry_) {
    const Odometry& one = odometry_[fed_odometry_];
    Pose T_child_sensor;
    if (params_.frames.T_base_sensor && (one.child.empty() || one.child == params_.frames.base)) {
      T_child_sensor = *params_.frames.mount();
    } else {
      auto found = frames_.pose(one.child.empty() ? params_.frames.base : one.child, sensor);
      if (!found || !*found) {
        notices_.tell("odometry_without_mount",
                      fmt::format("odometry is that of the frame '{}', and no transform leads from "
                                  "it to '{}': left out",
                                  one.child, sensor));
        continue;
      }
      T_child_sensor = **found;
    }
    const OdometrySample sample{.stamp = one.stamp,
                                .T_odom_body = one.T_odom_child * T_child_sensor};
    if (!localizer_.add(sample)) {
      notices_.tell("odometry_unusable", "odometry is no rigid transform: left out");
    }
  }
}

/// T_odom_base, between the two samples around the stamp. A pose of another moment would move the
/// map under the robot by what it drove since. Who waits for no samples (motion_wait = 0) has the
/// one before the stamp only, so the motion between the last two is taken to go on for a moment.
std::optional<Pose> Session::odometry_at(double stamp, const std::string& base) const {
  constexpr double kLongestGap = 0.5, kGoesOn = 0.05;  // [s]
  auto after = std::ranges::lower_bound(odometry_, stamp, {}, &Odometry::stamp);
  if (after == odometry_.end() && !odometry_.empty()) --after;
  if (after == odometry_.end() || stamp - after->stamp > kGoesOn) return std::nullopt;
  Pose pose = after->T_odom_child;
  if (after->stamp != stamp) {
    if (after == odometry_.begin()) return std::nullopt;
    const Odometry& before = *std::prev(after);
    const double gap = after->stamp - before.stamp;
    if (gap > kLongestGap) return std::nullopt;
    pose = interpolate(before.T_odom_child, after->T_odom_child, (stamp - before.stamp) / gap);
  }
  if (after->child.empty() || after->child == base) return pose;
  const auto T_child_base = frames_.pose(after->child, base);
  if (!T_child_base || !*T_child_base) return std::nullopt;
  return pose * **T_child_base;
}

/// A hint is used up once the sensor was looked for around it: not by a scan without points, nor by
/// a search that failed and found nothing. What fails in another way fails again.
void Session::use_hint(const Result<ScanReport>& report) {
  if (!priors_.has_hint()) return;
  const bool is_under_way = report && report->searching;
  priors_.set_hint_aside(is_under_way);
  if (is_under_way) return;
  const bool is_used =
      report ? report->scan_points > 0 && (report->has_pose || report->search_failure.empty())
             : report.error().code != ErrorCode::io_failure;
  if (is_used) return priors_.use_up_hint();
  begin_anywhere();  // after a scan in vain, a localizer may rest before it searches again
}

Result<std::optional<Localized>> Session::localize() {
  Waiting now = std::move(waiting_.front());
  waiting_.pop_front();
  if (!requests_.wants_scan()) {
    notices_.count("scans_while_off");
    return std::nullopt;
  }
  const std::string sensor(frame_name(now.header.frame));
  const auto T_base_sensor = mount(sensor);
  if (!T_base_sensor) {
    leave_out("scans_without_mount", T_base_sensor.error().message);
    return std::nullopt;
  }
  left_out_.reset();
  if (const auto second =
          frames_.second_parent(params_.frames.base, sensor, now.received.arrival)) {
    notices_.tell("lidar_with_two_parents",
                  *second + ": where the LiDAR is depends on who is asked");
  }
  if (!is_started_) {
    notices_.tell(
        "scans_before_start",
        fmt::format("no pose has come on {} yet: scans are left out", params_.topics.initial_pose));
    return std::nullopt;
  }
  const bool is_covered = has_motion(now);
  if (!is_covered) {
    notices_.tell("scans_without_motion",
                  fmt::format("samples of IMU or odometry come more than {} s after their scan: it "
                              "is localized without them; see [live] motion_wait",
                              params_.motion_wait));
  }
  if (now.scan.points.empty()) {
    notices_.tell("scans_empty", "a scan has no point that was measured");
  }
  feed_motion(sensor);
  const auto prior = priors_.at(now.scan.stamp, *T_base_sensor);
  const auto begin = std::chrono::steady_clock::now();
  auto report = localizer_.localize({.stamp = now.scan.stamp,
                                     .points = now.scan.points,
                                     .seconds = now.scan.seconds,
                                     .prior = prior});
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  use_hint(report);
  if (!report) {
    left_out_ = to_string(report.error());
    return fail(std::move(report).error());
  }
  Localized done{.report = *std::move(report),
                 .scan = std::move(now.scan),
                 .stamp = now.header.stamp,
                 .received = std::move(now.received),
                 .T_base_sensor = *T_base_sensor,
                 .T_odom_base = odometry_at(now.header.stamp, params_.frames.base),
                 .prior = prior,
                 .seconds = took.count()};
  if (is_covered) tell_silent_motion(now, done.T_odom_base.has_value());
  if (done.report.tracking == Tracking::tracked) last_ = done.report.T_map_scan;
  T_base_sensor_ = *T_base_sensor;
  if (params_.topics.imu.empty()) moved_ = now.end;
  requests_.see(done);
  if (!requests_.is_on()) return std::nullopt;
  return done;
}

}  // namespace vantage::live
