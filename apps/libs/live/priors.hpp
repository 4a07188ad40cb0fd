#pragma once

#include <deque>
#include <optional>
#include <string>

#include "io/map_projection.hpp"
#include "io/ros/messages.hpp"
#include "live/live_params.hpp"
#include "live/notices.hpp"
#include "live/received.hpp"
#include "live/static_frames.hpp"
#include "vantage/pose.hpp"
#include "vantage/track/pose_prior.hpp"

namespace vantage::live {

/// What others say about where the robot is: the last priors, and none that is more than 10 s
/// older than the last scan.
class Priors {
 public:
  /// @param projection  where the map is on the earth; without it, fixes are left out
  Priors(const LiveParams& params, std::optional<io::MapProjection> projection, Notices& notices)
      : base_(params.frames.base),
        fix_topic_(params.topics.fix),
        projection_(std::move(projection)),
        notices_(notices) {}

  /// Of the robot, in the map.
  void add(const io::ros::PoseMessage& pose);
  /// Adds a place of the antenna, without a heading. Tells of a fix that cannot be used, once for
  /// each reason, and leaves it out.
  void add(const io::ros::FixMessage& fix, const StaticFrames& frames);
  /// A pose by hand: scans get it, and no other prior, until it is used up.
  void hint(const io::ros::PoseMessage& pose);
  /// Whether a hint waits for a scan.
  [[nodiscard]] bool has_hint() const noexcept { return hint_.has_value(); }
  /// The hint is no prior of later scans while a search with it is under way.
  void set_hint_aside(bool is_aside) { hint_is_aside_ = is_aside; }
  /// The sensor was looked for with the hint.
  void use_up_hint() { hint_.reset(); }
  /// What was added, without the hint.
  void forget() { priors_.clear(); }

  /// The prior for a scan: the hint, else the one that is nearest in time, within 0.15 s. Its pose
  /// is that between two, if another of its source is on the other side of the stamp.
  /// @param stamp  [s]
  [[nodiscard]] std::optional<PosePrior> at(double stamp, const Pose& T_base_sensor);

 private:
  struct Prior {
    Input input;
    double stamp;
    Pose T_map_base;
    io::ros::PoseVariances variances;
  };
  [[nodiscard]] static Prior of(Input input, const io::ros::PoseMessage& pose);
  void keep(const Prior& prior);
  [[nodiscard]] std::optional<Prior> nearest(double stamp) const;

  std::string base_, fix_topic_;
  std::optional<io::MapProjection> projection_;
  Notices& notices_;
  std::optional<Prior> hint_;
  bool hint_is_aside_ = false;
  double altitude_ = 0.0;  // of the last fix that had one [m]
  std::deque<Prior> priors_;
};

}  // namespace vantage::live
