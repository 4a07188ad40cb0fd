#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "io/map_projection.hpp"
#include "io/ros/message_writers.hpp"
#include "io/ros/messages.hpp"
#include "live/live_params.hpp"
#include "live/notices.hpp"
#include "live/priors.hpp"
#include "live/received.hpp"
#include "live/requests.hpp"
#include "live/static_frames.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::live {

/// A scan that was localized.
struct Localized {
  ScanReport report;
  io::StampedScan scan;
  io::ros::Stamp stamp;                  ///< of the scan, to the nanosecond
  Received received;                     ///< what the scan was read from
  Pose T_base_sensor;                    ///< of the LiDAR
  std::optional<Pose> T_odom_base = {};  ///< at the scan's stamp, if odometry reaches to it
  std::optional<PosePrior> prior = {};   ///< that it was localized with
  double seconds = 0.0;                  ///< from the points to the report
};

/// The sensor's motion after the last scan.
struct Moved {
  io::ros::Stamp stamp;
  SensorMotion motion;
  Pose T_base_sensor;
};

/// Why no scan is localized at present.
struct Idle {
  io::ros::Diagnostic::Level level;
  std::string message;
};

/// A localizer that lives on messages, whatever brings them. What it answers depends on the
/// messages and on the moments at which they came, and on nothing else (unless [localizer] live is
/// set), so that a recording of them gives the same answers.
/// A message that cannot be used is told once (see Notices) and left out; nothing ends a session.
class Session {
 public:
  /// @param kept        where the sensor was when a session before ended
  /// @param projection  where the map is on the earth, for fixes
  Session(Localizer localizer, LiveParams params, const std::optional<Pose>& kept, Notices& notices,
          std::optional<io::MapProjection> projection = {});

  /// Takes a message in. A scan waits until `localize`; the oldest one that waits is dropped for it
  /// if both could be localized.
  void take(Received&& received);
  [[nodiscard]] bool has_scan() const noexcept { return !waiting_.empty(); }
  /// Whether a scan waits, and the oldest either has all samples of motion that it needs, or has
  /// waited for them long enough.
  /// @param now  as Received::arrival [ns]
  [[nodiscard]] bool is_ready(std::int64_t now) const {
    return has_scan() && is_ready(waiting_.front(), now);
  }
  /// Localizes the oldest scan that waits. Precondition: has_scan(). Nothing if it cannot be used,
  /// or if a service switched the localizer off. Errors: a region map that cannot be loaded or
  /// prepared; the session goes on.
  [[nodiscard]] Result<std::optional<Localized>> localize();

  /// The motion at the last sample of the IMU, or at the end of the last sweep without an IMU.
  /// Nothing if that was told already, or if the last scan was not tracked.
  [[nodiscard]] std::optional<Moved> moved();

  /// All reasons for which no scan is localized, and the level of the worst. Nothing if the last
  /// scan was localized and came a moment ago.
  /// @param until      all that came by then was taken in; as Received::arrival [ns]
  /// @param obstacles  why messages do not come, known to what brings them
  [[nodiscard]] std::optional<Idle> idle(std::int64_t until,
                                         const std::vector<std::string>& obstacles = {}) const;

  /// Answers to requests, since the last call.
  /// @param now  as Received::arrival [ns]
  [[nodiscard]] std::vector<Answer> take_answers(std::int64_t now) {
    return requests_.take_answers(now);
  }

  [[nodiscard]] const Localizer& localizer() const noexcept { return localizer_; }

 private:
  struct Waiting {
    io::StampedScan scan;
    io::ros::Header header;
    Received received;
    io::ros::Stamp end;  // of the sweep
  };
  struct Odometry {
    double stamp;
    Pose T_odom_child;
    std::string child;
  };

  [[nodiscard]] Result<void> read(Received& received);
  [[nodiscard]] Result<void> read_points(Received& received);
  [[nodiscard]] Result<void> read_imu(const std::string& message);
  [[nodiscard]] Result<void> read_odometry(const std::string& message);
  [[nodiscard]] Result<void> read_pose(const Received& received);
  [[nodiscard]] Result<void> read_trigger(const Received& received);
  [[nodiscard]] Result<void> read_fix(const std::string& message);
  [[nodiscard]] Result<void> read_transforms(const Received& received);
  [[nodiscard]] bool is_ahead(double stamp, Input input);
  [[nodiscard]] bool is_behind(double stamp, Input input);
  void begin_anew(const std::string& why);
  void begin_anywhere();
  void drop_overdue();
  [[nodiscard]] bool has_motion(const Waiting& scan) const;
  [[nodiscard]] bool has_waited(const Waiting& scan, std::int64_t now) const;
  [[nodiscard]] bool is_ready(const Waiting& scan, std::int64_t now) const {
    return has_waited(scan, now) || has_motion(scan);
  }
  void tell_silent_motion(const Waiting& scan, bool has_odometry);
  void use_hint(const Result<ScanReport>& report);
  [[nodiscard]] Result<Pose> mount(const std::string& frame) const;
  void leave_out(std::string_view kind, const std::string& why);
  void feed_imu();
  void feed_motion(const std::string& sensor);
  [[nodiscard]] std::optional<Pose> odometry_at(double stamp, const std::string& base) const;

  Localizer localizer_;
  LiveParams params_;
  Notices& notices_;
  Priors priors_;
  Requests requests_;
  StaticFrames frames_;
  std::deque<Waiting> waiting_;        // for their samples of motion, or to be localized
  std::optional<double> first_stamp_;  // of a scan [s]
  std::optional<double> last_stamp_;   // of a scan [s]
  std::optional<Pose> last_;           // T_map_sensor, tracked
  bool is_started_ = false;
  std::optional<std::int64_t> scan_came_;           // the last, usable or not [ns]
  std::optional<std::string> left_out_;             // why the last scan was
  std::optional<Pose> T_base_sensor_;               // of the last scan
  std::optional<io::ros::Stamp> moved_;             // for moved()
  std::deque<ImuSample> imu_;                       // that the localizer has not got yet
  std::size_t fed_odometry_ = 0;                    // of odometry_
  std::deque<Odometry> odometry_;                   // of the last seconds
  std::optional<double> last_imu_, last_odometry_;  // [s]
};

}  // namespace vantage::live
