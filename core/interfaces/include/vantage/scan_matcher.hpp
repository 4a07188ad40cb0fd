#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/map_element.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/prepared_map.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_score.hpp"

namespace vantage {

/// Why an alignment ended.
enum class Termination : std::uint8_t {
  converged,       ///< the last step was below the matcher's tolerances
  max_iterations,  ///< the iteration limit was reached before convergence
  no_progress,     ///< no step along the search direction improves the objective
};
[[nodiscard]] VANTAGE_API const char* to_string(Termination) noexcept;

/// The result of matching one scan against one map.
struct Alignment {
  /// Rows in this order: translation x, y, z [m], then rotation vector x, y, z [rad]; axes of the
  /// map frame, rotation about the sensor. DontAlign, because the matrix crosses the plugin
  /// boundary.
  using Hessian = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

  Pose T_map_scan;
  Termination termination = Termination::max_iterations;
  std::uint32_t iterations = 0;
  ScanScore score;  ///< of `T_map_scan`
  /// Hessian of the minimized negative log-likelihood at `T_map_scan`, times a factor of the
  /// matcher's own, so that users of all matchers can read it alike: 0.003 (N + 700) times its
  /// inverse is about the covariance of the pose, for N points (LocalizerParams::covariance_scale).
  Hessian hessian = Hessian::Zero();
};

/// A map that is ready for matching. It owns all its data: the points that it was prepared from may
/// be destroyed.
/// Thread safety: const methods may run on one object from many threads at once. The number of
/// threads does not change an answer.
class VANTAGE_API MatchTarget {
 public:
  virtual ~MatchTarget();

  /// Finds the pose of a scan near a guess. T_align of Sec. 3.3 is the time of this call alone.
  /// @param scan              N points, sensor frame [m]; finite
  /// @param T_map_scan_guess  the predicted pose
  /// Errors: `too_few_matches` for an empty scan, or one that does not overlap the map at the
  /// guess; `invalid_input` for a non-finite point or a pose that is not valid (see is_valid).
  [[nodiscard]] virtual Result<Alignment> align(PointsView scan,
                                                const Pose& T_map_scan_guess) const noexcept = 0;

  /// How well a scan fits the map at a given pose: S_fitness (Eq. 12) and its companions.
  /// Errors: as `align`, except that a scan without overlap is not an error: its fitness and
  /// coverage are 0.
  [[nodiscard]] virtual Result<ScanScore> score(PointsView scan,
                                                const Pose& T_map_scan) const noexcept = 0;

  /// Memory that the target holds now [bytes]; counts towards memory limits. It may grow while the
  /// target is used.
  [[nodiscard]] virtual std::size_t bytes() const noexcept = 0;
  /// The number of things that a scan point can be compared with: distributions or points.
  [[nodiscard]] virtual std::size_t elements() const noexcept = 0;

  /// Extracts the part of the target around some of the points that it was prepared from, so that a
  /// store can keep this part. The elements stay as `prepare` made them from the whole map; the
  /// seen points alone would give other elements.
  /// @param seen  N map points, map frame [m]; every element that one of them belongs to is kept
  /// Errors: `unsupported` (the default); `invalid_input` for a non-finite point.
  [[nodiscard]] virtual Result<PreparedMap> excerpt(PointsView seen) const noexcept;

  /// The elements that the points belong to, ascending by number, each once. Elements are numbered
  /// from 0 to `elements()`.
  /// @param seen  N map points, map frame [m]
  /// Errors: `unsupported` (the default); `invalid_input` for a non-finite point.
  [[nodiscard]] virtual Result<std::vector<MapElement>> elements_at(PointsView seen) const noexcept;

  /// What each element does to the pose of a scan at that pose: the objective that `align`
  /// minimizes is a sum over elements, and these are the derivatives of its terms, times the factor
  /// of Alignment::hessian. If a term depends on which other elements there are, it is that of an
  /// element whose neighbours are not kept. Elements that do nothing are left out.
  /// @return  ascending by element
  /// Errors: `unsupported` (the default); otherwise as `score`.
  [[nodiscard]] virtual Result<std::vector<Pull>> pulls(PointsView scan,
                                                        const Pose& T_map_scan) const noexcept;

  /// As `excerpt`, but of those elements only some are kept. Of the others, a matcher may keep what
  /// a score needs, so that the scores resemble those of the whole excerpt.
  /// @param seen  numbers of elements as `elements_at` returns them
  /// @param kept  some of them, ascending
  /// Errors: `unsupported` (the default); `invalid_input` for numbers that are not so.
  [[nodiscard]] virtual Result<PreparedMap> excerpt_of(
      std::span<const std::uint32_t> seen, std::span<const std::uint32_t> kept) const noexcept;
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

  /// Makes a target from what `MatchTarget::excerpt` returned.
  /// Errors: `unsupported` (the default); `corrupt_data` for bytes that are not an excerpt;
  /// `invalid_input` for an excerpt made with parameters that contradict those of this matcher;
  /// `too_few_matches` for an empty excerpt.
  [[nodiscard]] virtual Result<std::unique_ptr<MatchTarget>> restore(
      std::span<const std::byte> prepared) const noexcept;

  /// How far from a map point, in plan view, points may lie that decide what `excerpt` keeps for it
  /// [m]. A build from tiles prepares a part of the map with this margin, and expects the bytes
  /// that the whole map gives. Infinite (the default): `prepare` needs the whole map at once.
  [[nodiscard]] virtual double reach() const noexcept;
};

}  // namespace vantage
