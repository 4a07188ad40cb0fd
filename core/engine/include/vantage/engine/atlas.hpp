#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/matcher_choice.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A place that a scan of a site fits as well, or nearly.
struct AlikePlace {
  Pose T_map_scan;  ///< where the scan was aligned to
  /// Its evidence there, relative to that at the right pose; > 0. The evidence is the share of the
  /// sharpness that a perfect map would give (docs/localization.md).
  double likeness = 0.0;
};

/// How precisely a scan of a site is localized.
struct SitePrecision {
  /// Root mean square of the horizontal error [m]. It adds the scatter of alignments from starts
  /// 0.5 m off and their covariance.
  double expected_error = 0.0;
  /// Standard deviations along the horizontal axes of which most and least is known [m].
  double sigma_strong = 0.0, sigma_weak = 0.0;
  /// The axis of `sigma_weak` in plan view, anticlockwise from the map's x axis [rad], in [0, pi).
  /// It says little if `sigma_weak` is less than twice `sigma_strong`.
  double weak_direction = 0.0;
  /// The largest of the tried offsets of a start [m] up to which alignments come back to the right
  /// pose from all directions; 0 if they do not even from the smallest.
  double basin = 0.0;

  friend bool operator==(const SitePrecision&, const SitePrecision&) = default;
};

/// A viewpoint at which it was measured how well a sensor can be localized there.
struct Site {
  RegionId region;                         ///< whose viewpoint it is
  Point position = Point::Zero();          ///< of the sensor, map frame [m]
  std::optional<SitePrecision> precision;  ///< none: a scan from here matches nothing
  std::vector<AlikePlace> alike;           ///< the most alike first
};

/// How well a sensor can be localized in a bundle: measured at sites all over the map with virtual
/// scans and the matcher of a configuration (Assessment).
struct VANTAGE_API Atlas {
  /// The name of its bytes in a bundle.
  static constexpr const char* kAttachment = "atlas";

  MatcherChoice matcher;    ///< with which it was measured
  std::vector<Site> sites;  ///< in the order of their regions

  /// The atlas of a bundle; none if it was not assessed.
  /// Errors: those of MapReader::attachment; `corrupt_data` for bytes that `encode` does not make,
  /// or for a site in a region that the bundle does not have.
  [[nodiscard]] static Result<std::optional<Atlas>> of_bundle(const Bundle& bundle);

  /// Uses memory in proportion to the number of bytes.
  /// Errors: `corrupt_data` for bytes that `encode` does not make.
  [[nodiscard]] static Result<Atlas> decode(std::span<const std::byte> bytes);
  /// Precondition: numbers are finite and in the ranges stated above.
  [[nodiscard]] std::vector<std::byte> encode() const;

  /// The site nearest to a place in space; none without sites. The first of equally near ones.
  [[nodiscard]] const Site* nearest(const Point& place) const noexcept;
};

}  // namespace vantage
