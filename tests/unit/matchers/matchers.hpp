#pragma once

#include <string>
#include <vector>

#include "scenes.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage::test {

/// A map made ready by a loaded plugin; a mistake in `toml` or an error ends the test with an
/// exception.
[[nodiscard]] PluginPtr<MatchTarget> prepared_by(const std::string& plugin, PointsView map,
                                                 const std::string& toml = {});

/// The alignment; an error ends the test with an exception.
[[nodiscard]] Alignment aligned(const MatchTarget& target, PointsView scan, const Pose& guess);

/// Why a loaded plugin refuses to make this map ready; a map that it takes ends the test with an
/// exception.
[[nodiscard]] Error refusal_of_map(const std::string& plugin, PointsView map);

/// Between the poses [m] and [degrees].
[[nodiscard]] double metres_off(const Alignment& alignment, const Pose& pose);
[[nodiscard]] double degrees_off(const Alignment& alignment, const Pose& pose);

/// A map point with its unit normal, found by trying all points; zero normal where the `k` nearest
/// show no plane.
struct Surfel {
  Point point;
  Eigen::Vector3d normal;
};
[[nodiscard]] std::vector<Surfel> surfels_of(PointsView cloud, std::size_t k);

/// Index of the nearest surfel, by trying all.
[[nodiscard]] std::size_t nearest(const std::vector<Surfel>& surfels, const Point& x);

}  // namespace vantage::test
