#include "live/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "io/made_scan.hpp"
#include "live/map_poses.hpp"

namespace vantage::live {
namespace {

using io::ros::Encoding;
using io::ros::frame_name;

// Stamps that go back by more than this are those of a clock that was set [s].
constexpr double kClockJump = 1.0;
// A source of motion that has been silent for longer than this is not waited for, nor is one that
// has not spoken for the time after the first scan [s].
constexpr double kSilent = 1.0, kFirstWord = 5.0;
// Without a scan for longer than this, scans are said to be missing [s].
constexpr double kNoScan = 2.0;
// Samples are kept for this long [s].
constexpr double kKept = 10.0;
// What is stamped later than this after the last scan is not of its clock, or of another drive [s].
constexpr double kAhead = 60.0;

double seconds_between(std::int64_t from, std::int64_t to) {  // of [ns]
  return static_cast<double>(to - from) * 1e-9;
}

template <class Sample>
void forget_old(std::deque<Sample>& samples) {
  while (!samples.empty() && samples.front().stamp < samples.back().stamp - kKept) {
    samples.pop_front();
  }
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

void Session::take(Received&& received) {
  const bool is_scan = received.input == Input::points;
  if (is_scan) scan_came_ = received.arrival;
  const auto done = read(received);
  if (done) return;
  const Error& error = done.error();
  if (received.request) {
    return requests_.refuse(received.input, *received.request, error.message);
  }
  const std::string kind = fmt::format("{}_unusable", name_of(received.input));
  const std::string why = fmt::format("a message of the topic '{}' cannot be used: {}",
                                      name_of(received.input), error.message);
  if (is_scan) return leave_out(kind, why);
  notices_.tell(kind, why);
}

/// Tells why a scan is not localized.
void Session::leave_out(std::string_view kind, const std::string& why) {
  left_out_ = why;
  notices_.tell(kind, why);
}

Result<void> Session::read(Received& received) {
  switch (received.input) {
    case Input::points: return read_points(received);
    case Input::imu: return read_imu(received.message);
    case Input::odometry: return read_odometry(received.message);
    case Input::initial_pose:
    case Input::prior:
    case Input::align: return read_pose(received);
    case Input::trigger: return read_trigger(received);
    case Input::fix: return read_fix(received.message);
    case Input::followed_pose: return {};  // of a MapServer
    case Input::transforms: return read_transforms(received.message);
    case Input::static_transforms: {
      VANTAGE_TRY(const auto transforms,
                  io::ros::parse_poses(received.message, "tf2_msgs/TFMessage", Encoding::cdr, {}));
      for (const auto& one : transforms) {
        const auto added = frames_.add(one);
        if (added) continue;  // a message has the frames of a whole robot, the LiDAR's among them
        notices_.tell("static_transforms_invalid",
                      fmt::format("the transform from '{}' to '{}' of /tf_static is left out: {}",
                                  one.header.frame, one.child, added.error().message));
      }
      return {};
    }
  }
  return {};
}

Result<void> Session::read_points(Received& received) {
  VANTAGE_TRY(auto cloud, io::ros::parse_point_cloud2(received.message, Encoding::cdr, {}));
  const double stamp = cloud.header.stamp;
  const double step = last_stamp_ ? stamp - *last_stamp_ : 0.0;
  if (step < -kClockJump || step > kAhead) {  // what was known of the motion says nothing
    waiting_.clear();
    begin_anew(fmt::format("the stamps of scans {} by {:.3f} s: begins anew{}",
                           step < 0.0 ? "went back" : "jumped ahead", std::abs(step),
                           last_ ? " from the last pose" : ""));
  }
  if (last_stamp_ && stamp <= *last_stamp_) {
    leave_out(
        "scans_out_of_order",
        fmt::format("a scan is stamped {:.6f} s, no later than the one before: left out", stamp));
    return {};
  }
  VANTAGE_TRY(auto scan, io::made_scan(std::move(cloud.cloud), stamp, {}, params_.topics.points));
  const double sweep =
      scan.seconds.empty() ? 0.0 : static_cast<double>(std::ranges::max(scan.seconds));
  last_stamp_ = stamp;
  if (!first_stamp_) first_stamp_ = stamp;
  waiting_.push_back({.scan = std::move(scan),
                      .header = cloud.header,
                      .received = std::move(received),
                      .end = sweep > 0.0 ? io::ros::Stamp(stamp + sweep) : cloud.header.stamp});
  drop_overdue();
  return {};
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

/// Whether a stamp cannot be of the scans' clock. One such sample would hide all that follow.
bool Session::is_ahead(double stamp, Input input) {
  if (!last_stamp_ || stamp <= *last_stamp_ + kAhead) return false;
  notices_.tell(fmt::format("{}_ahead", name_of(input)),
                fmt::format("a message of the topic '{}' is stamped {:.1f} s later than the last "
                            "scan: left out",
                            name_of(input), stamp - *last_stamp_));
  return true;
}

/// Whether a stamp is of no scan that comes. A sender whose clock is not set has such stamps.
bool Session::is_behind(double stamp, Input input) {
  if (!last_stamp_ || stamp >= *last_stamp_ - kKept) return false;
  notices_.tell(fmt::format("{}_behind", name_of(input)),
                fmt::format("a message of the topic '{}' is stamped {:.1f} s earlier than the last "
                            "scan: left out",
                            name_of(input), *last_stamp_ - stamp));
  return true;
}

Result<void> Session::read_imu(const std::string& message) {
  VANTAGE_TRY(const auto imu, io::ros::parse_imu(message, Encoding::cdr, {}));
  if (!imu.is_measured) {
    notices_.tell("imu_unusable", "the IMU says that it does not measure rates or accelerations");
    return {};
  }
  const double unit = params_.force_unit();
  const ImuSample sample{.stamp = imu.header.stamp,
                         .angular_velocity = imu.angular_velocity,
                         .specific_force = unit * imu.linear_acceleration};
  if (!is_valid(sample)) {
    notices_.tell("imu_unusable",
                  "a sample of the IMU has a number that is not finite or possible");
    return {};
  }
  if (is_ahead(sample.stamp, Input::imu)) return {};
  if (const double force = sample.specific_force.norm();
      unit == 1.0 && force > 0.8 && force < 1.2) {
    notices_.tell("imu_in_g",
                  fmt::format("the IMU's acceleration is {:.2f} m/s^2, as if it were in g: see "
                              "[live] imu_unit",
                              force));
  }
  if (last_imu_ && sample.stamp < *last_imu_ - kClockJump) imu_.clear();
  last_imu_ = sample.stamp;
  moved_ = imu.header.stamp;
  imu_.push_back(sample);
  forget_old(imu_);
  return {};
}

Result<void> Session::read_odometry(const std::string& message) {
  VANTAGE_TRY(const auto poses,
              io::ros::parse_poses(message, "nav_msgs/Odometry", Encoding::cdr, {}));
  for (const auto& one : poses) {
    const double stamp = one.header.stamp;
    if (is_ahead(stamp, Input::odometry)) continue;
    if (last_odometry_ && stamp < *last_odometry_ - kClockJump) {
      odometry_.clear();
      fed_odometry_ = 0;
    } else if (last_odometry_ && stamp <= *last_odometry_) {
      notices_.tell(
          "odometry_out_of_order",
          fmt::format("odometry is stamped {:.6f} s, no later than before: left out", stamp));
      continue;
    }
    last_odometry_ = stamp;
    odometry_.push_back({stamp, one.pose, std::string(frame_name(one.child))});
    while (odometry_.front().stamp < odometry_.back().stamp - kKept) {
      odometry_.pop_front();
      if (fed_odometry_ > 0) --fed_odometry_;
    }
  }
  return {};
}

Result<void> Session::read_pose(const Received& received) {
  const Input input = received.input;
  VANTAGE_TRY(const auto poses,
              poses_in_map(input, received.message, params_.frames.map, notices_));
  if (poses.empty() && input == Input::align) {
    return fail(ErrorCode::invalid_input, "its pose is not in the map's frame");
  }
  for (const auto& one : poses) {
    if (input == Input::prior) {
      const double stamp = one.header.stamp;
      if (!is_ahead(stamp, input) && !is_behind(stamp, input)) priors_.add(one);
      continue;
    }
    notices_.say(fmt::format("a pose is given: looks for the sensor at x {:.1f}, y {:.1f}",
                             one.pose.translation.x(), one.pose.translation.y()));
    priors_.hint(one);
    last_.reset();
    begin_anywhere();
    if (input == Input::align) requests_.align(received);
  }
  return {};
}

Result<void> Session::read_trigger(const Received& received) {
  VANTAGE_CHECK(requests_.trigger(received));
  if (requests_.is_on() && !is_started_) begin_anywhere();
  return {};
}

Result<void> Session::read_fix(const std::string& message) {
  VANTAGE_TRY(const auto fix, io::ros::parse_nav_sat_fix(message, Encoding::cdr, {}));
  const double stamp = fix.header.stamp;
  if (!is_ahead(stamp, Input::fix) && !is_behind(stamp, Input::fix)) priors_.add(fix, frames_);
  return {};
}

/// What other nodes say of frames that move. A frame with two parents jumps between them.
Result<void> Session::read_transforms(const std::string& message) {
  VANTAGE_TRY(const auto transforms,
              io::ros::parse_poses(message, "tf2_msgs/TFMessage", Encoding::cdr, {}));
  const auto own = params_.published_child();
  for (const auto& one : transforms) {
    frames_.add_moving(one);
    const std::string_view child = frame_name(one.child);
    if (child != own) continue;
    notices_.tell("frames_with_two_parents",
                  fmt::format("another node publishes '{}' under '{}' in /tf, and this one under "
                              "'{}': the frame jumps between them; only one node may, see [live] "
                              "transform",
                              child, frame_name(one.header.frame), params_.frames.map));
  }
  return {};
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

std::optional<Idle> Session::idle(std::int64_t now) const {
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
  } else if (const double silent = seconds_between(*scan_came_, now); silent > kNoScan) {
    add(Level::stale, fmt::format("no scan has come on {} for {:.0f} s", topics.points, silent));
  }
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
  if (const auto second = frames_.second_parent(params_.frames.base, sensor)) {
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
