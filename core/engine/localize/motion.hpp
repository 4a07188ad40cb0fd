#pragma once

#include <optional>

#include "vantage/engine/prepared_scan.hpp"
#include "vantage/pose.hpp"

namespace vantage {

/// Where the sensor was at the last two scans, and what that says of the next one.
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

  /// Where the sensor is at `scan`: by odometry, else by constant velocity in the sensor's own
  /// frame, so that a turn goes on as a turn; at the last pose before a second one is known.
  /// Precondition: started.
  [[nodiscard]] Pose predict(const Scan& scan) const;
  /// The latest movement that is known; none before a second pose.
  [[nodiscard]] std::optional<Step> step() const;
  /// The same with a scan that has odometry.
  [[nodiscard]] std::optional<Step> step_to(const Scan& scan) const;
  /// [m/s], map frame; zero before a second pose.
  [[nodiscard]] Eigen::Vector3d velocity() const;

  void add(const Scan& scan, const Pose& T_map_scan);
  /// The last pose was another one: the sensor moves on from there as it did.
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
