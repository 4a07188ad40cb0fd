#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "vantage/io/scan_source.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::checks {

/// The plane that a scan shows below or above the sensor.
struct GroundPlane {
  double distance = 0.0;  ///< of the sensor from the plane [m]
  double tilt = 0.0;      ///< between its normal and the sensor's z axis [rad]
  double share = 0.0;     ///< of the square metres around the sensor that lie in it
};
/// The ground of a scan: the plane that most of the lowest points of the square metres around the
/// sensor lie in, to 0.1 m. Planes tilted by more than 30 degrees do not count.
/// @param scan   N points, sensor frame [m]
/// @param above  look for a plane above the sensor, with the highest points
/// None if there are too few points, or if half of the plane is not below (above) the sensor.
[[nodiscard]] std::optional<GroundPlane> find_ground(PointsView scan, bool above);

/// What some scans of a recording say about it.
struct ScanFacts {
  std::size_t scans = 0;       ///< that were looked at
  std::size_t empty = 0;       ///< of these, without a point
  double points = 0.0;         ///< median of those that have some
  bool timed = false;          ///< the points of all of them have times
  double sweep = 0.0;          ///< median time from the first to the last point of a scan [s]
  double dropped_share = 0.0;  ///< of the points: no returns and coordinates that are not finite
  /// How far the middle of a scan is from the sensor (medians of its coordinates), as a multiple of
  /// the median distance of its points from there. Median over the scans; 0 without points.
  double eccentricity = 0.0;
  /// Scans that were looked for the place of their sensor, and those of them that were not taken
  /// from the origin; the farthest such place [m].
  std::size_t placed = 0, elsewhere = 0;
  double farthest = 0.0;
  /// Ranges of up to 20,000 of their points each, ascending [m].
  std::vector<float> ranges;
  /// Elevations of those of these points that are farther away than 1 m, ascending [rad].
  std::vector<float> elevations;
  /// Medians over the scans that show such a plane; none if fewer than half of them do.
  std::optional<GroundPlane> below, above;

  /// The range that a share of the points is below [m]; 0 without points.
  [[nodiscard]] double range_at(double share) const;
  /// The elevation that a share of the points is below [rad]; 0 without elevations.
  [[nodiscard]] double elevation_at(double share) const;
  /// The share of points whose range is in [least, most].
  [[nodiscard]] double share_within(double least, double most) const;
};

/// Measures scans, one after the other, and keeps none of them.
class ScanSurvey {
 public:
  /// Of the scans that are offered, one in ten of so many first ones is measured.
  static constexpr std::size_t kAmong = 50;

  void offer(const io::StampedScan& scan);
  void add(const io::StampedScan& scan);
  /// Only looks for the place of the sensor.
  void place(const io::StampedScan& scan);
  [[nodiscard]] ScanFacts facts() const;

 private:
  std::size_t offered_ = 0;
  ScanFacts sums_;
  std::uint64_t points_ = 0, dropped_ = 0;
  std::vector<double> sizes_, sweeps_, eccentricities_;
  std::vector<GroundPlane> below_, above_;
};

}  // namespace vantage::checks
