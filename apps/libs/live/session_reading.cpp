#include "live/session.hpp"

#include <fmt/format.h>

#include <algorithm>
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
// Samples are kept for this long [s].
constexpr double kKept = 10.0;
// What is stamped later than this after the last scan is not of its clock, or of another drive [s].
constexpr double kAhead = 60.0;

template <class Sample>
void forget_old(std::deque<Sample>& samples) {
  while (!samples.empty() && samples.front().stamp < samples.back().stamp - kKept) {
    samples.pop_front();
  }
}

}  // namespace

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
    case Input::transforms: return read_transforms(received);
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
Result<void> Session::read_transforms(const Received& received) {
  VANTAGE_TRY(const auto transforms,
              io::ros::parse_poses(received.message, "tf2_msgs/TFMessage", Encoding::cdr, {}));
  const auto own = params_.published_child();
  for (const auto& one : transforms) {
    frames_.add_moving(one, received.arrival);
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

}  // namespace vantage::live
