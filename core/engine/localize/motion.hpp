#pragma once

#include <optional>

#include "vantage/engine/prepared_scan.hpp"
#include "vantage/pose.hpp"

namespace vantage {

/// The poses of the sensor at the last two scans. They predict its pose at the next scan.
class Motion {
 public:
  struct Step {
    Pose T_now_later;
    double seconds;
  };

  [[nodiscard]] bool started() const noexcept { return last_.has_value(); }
  /// Precondition: started.
  [[nodiscard]] double stamp() const { return last_->stamp; }
  [[nodiscard]] const Pose& pose() const { return last_->T_map_scan; }

  /// Predicts where the sensor is at `scan`: by odometry, otherwise with constant velocity in the
  /// sensor's own frame, so that a turn continues as a turn. Before a second pose is known, the
  /// prediction is the last pose.
  /// Precondition: started.
  [[nodiscard]] Pose predict(const Scan& scan) const;
  /// The latest known movement; none before a second pose.
  [[nodiscard]] std::optional<Step> step() const;
  /// The movement to a scan that has odometry.
  [[nodiscard]] std::optional<Step> step_to(const Scan& scan) const;
  /// Whether the last scan had odometry.
  [[nodiscard]] bool has_odometry() const { return last_ && last_->odometry.has_value(); }
  /// [m/s], map frame; zero before a second pose.
  [[nodiscard]] Eigen::Vector3d velocity() const;

  void add(const Scan& scan, const Pose& T_map_scan);
  /// Replaces the last pose; the sensor's motion continues from there.
  void correct(const Pose& T_map_scan);
  void forget();

 private:
  struct Moment {
    double stamp;
    Pose T_map_scan;
    std::optional<Pose> odometry;
  };
  std::optional<Moment> before_last_, last_;
};

}  // namespace vantage
