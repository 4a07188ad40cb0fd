#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "scenes.hpp"
#include "vantage/conformance.hpp"
#include "vantage/pose.hpp"
#include "vantage/scan_matcher.hpp"

/// The place in which the clauses test matchers, and what the clauses share.
namespace vantage::conformance {

/// A street of 36 m with houses along it and one at its end, a car, a kiosk and poles, at an angle
/// in the map frame. It determines all six degrees of freedom. Another `random` gives other points
/// of the same place.
[[nodiscard]] PointCloud street(Random& random);
/// What a sensor at a pose sees within 15 m, at most `most` points, in its own frame.
[[nodiscard]] PointCloud seen_from(PointsView cloud, const Pose& T_map_scan, Random& random,
                                   std::size_t most = 4000);

/// Offsets to places far away: whole numbers of cells, if their edge is a multiple of 0.1 m up to a
/// metre [m].
inline const std::array<Point, 2> kFarByCells{Point(2.52e6, 5.04e6, 252.0), Point(-2.52e6, 0, 0)};
/// The pose of the scan of some_scene.
extern const Pose kTruth;
/// A map, and a scan of the same place made of other points.
struct Scene {
  PointCloud map, scan;
};
[[nodiscard]] Scene some_scene(const Subject& subject);

/// Moves a pose in a random direction, by a share of the offset that the matcher claims to correct.
[[nodiscard]] Pose off(Random& random, const Pose& pose, const MatcherClaims& claims,
                       double share = 1.0);

[[nodiscard]] Result<PluginPtr<MatchTarget>> try_prepare(const PluginPtr<ScanMatcher>& matcher,
                                                         PointsView map);
// The calls of a matcher; a failure fails the clause and ends it.
[[nodiscard]] PluginPtr<MatchTarget> prepare(const PluginPtr<ScanMatcher>& matcher, PointsView map);
[[nodiscard]] PluginPtr<MatchTarget> prepare(const Subject& subject, PointsView map);
[[nodiscard]] PluginPtr<MatchTarget> restore(const PluginPtr<ScanMatcher>& matcher,
                                             const std::vector<std::byte>& prepared);
[[nodiscard]] Alignment align(const MatchTarget& target, PointsView scan, const Pose& guess);
[[nodiscard]] ScanScore score(const MatchTarget& target, PointsView scan, const Pose& pose);
/// To a matcher that stores no prepared maps, the clause does not apply.
[[nodiscard]] PreparedMap excerpt(const MatchTarget& target, PointsView seen);

/// Checks that two poses agree as well as the matcher's claimed accuracy.
void check_close(const Subject& subject, const Pose& a, const Pose& b);
[[nodiscard]] bool same(const ScanScore& a, const ScanScore& b);
[[nodiscard]] bool same(const Alignment& a, const Alignment& b);

// The checks of clauses of their own files.
void hessian_is_positive(const Subject& subject);
void hessian_moves_along(const Subject& subject);

}  // namespace vantage::conformance
