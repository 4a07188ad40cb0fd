#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "vantage/api.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/prepared_map.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_score.hpp"

namespace vantage {

/// Why an alignment ended.
enum class Termination : std::uint8_t {
  converged,       ///< the last step was below the matcher's tolerances
  max_iterations,  ///< the iteration limit came first
  no_progress,     ///< no step along the search direction improves the objective
};
[[nodiscard]] VANTAGE_API const char* to_string(Termination) noexcept;

/// What matching one scan against one map gave.
struct Alignment {
  /// Order of the rows: translation x, y, z [m], then rotation vector x, y, z [rad], axes of the
  /// map frame, rotation about the sensor. Not aligned: it crosses the plugin boundary.
  using Hessian = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

  Pose T_map_scan;
  Termination termination = Termination::max_iterations;
  std::uint32_t iterations = 0;
  ScanScore score;  ///< of `T_map_scan`
  /// Of the negative log-likelihood that was minimized, at `T_map_scan`: its inverse is the pose's
  /// covariance as if the points' errors were independent.
  Hessian hessian = Hessian::Zero();
};

/// A map made ready for matching. Owns what it needs: the points it was prepared from can go.
/// Thread safety: const methods may run on one object from many threads at once and give the same
/// answer for any number of threads.
class VANTAGE_API MatchTarget {
 public:
  virtual ~MatchTarget();

  /// Finds the pose of a scan near a guess. T_align of Sec. 3.3 times this call and nothing else.
  /// @param scan              N points, sensor frame [m]; finite
  /// @param T_map_scan_guess  the predicted pose
  /// Errors: `too_few_matches` for an empty scan or one that does not overlap the map at the guess;
  /// `invalid_input` for a non-finite point or a pose that is not valid (see is_valid).
  [[nodiscard]] virtual Result<Alignment> align(PointsView scan,
                                                const Pose& T_map_scan_guess) const noexcept = 0;

  /// How well a scan fits the map at a given pose: S_fitness (Eq. 12) and its companions.
  /// Errors: as `align`; a scan without overlap has fitness 0 and coverage 0, which is no error.
  [[nodiscard]] virtual Result<ScanScore> score(PointsView scan,
                                                const Pose& T_map_scan) const noexcept = 0;

  /// Memory that the target holds, for budgets.
  [[nodiscard]] virtual std::size_t bytes() const noexcept = 0;
  /// How many things a scan point could be compared with: distributions, points.
  [[nodiscard]] virtual std::size_t elements() const noexcept = 0;

  /// The part of the target around some of the points it was prepared from, to be stored: what
  /// `prepare` makes of the whole map there, which the seen points alone would not tell.
  /// @param seen  N map points, map frame [m]; every element that one of them belongs to is kept
  /// Errors: `unsupported` (the default); `invalid_input` for a non-finite point.
  [[nodiscard]] virtual Result<PreparedMap> excerpt(PointsView seen) const noexcept;
};

/// Matches scans to maps (Sec. 2.4, 3.3).
/// Thread safety: `prepare` may run on one object from many threads at once.
class VANTAGE_API ScanMatcher {
 public:
  virtual ~ScanMatcher();

  /// @param map  N points of a region map, map frame [m]
  /// Errors: `invalid_input` for an empty map or a non-finite coordinate; `too_few_matches` for a
  /// map too sparse to match anything against.
  [[nodiscard]] virtual Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept = 0;

  /// Makes a target of what `MatchTarget::excerpt` gave.
  /// Errors: `unsupported` (the default); `corrupt_data` for bytes that no excerpt is made of;
  /// `invalid_input` for an excerpt made with parameters that do not agree with this matcher's;
  /// `too_few_matches` for an empty one.
  [[nodiscard]] virtual Result<std::unique_ptr<MatchTarget>> restore(
      std::span<const std::byte> prepared) const noexcept;
};

}  // namespace vantage
