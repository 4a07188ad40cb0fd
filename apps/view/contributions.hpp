#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/engine/atlas.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::view {

/// An element of a prepared map, and the sum of its leverages over scans.
struct Contribution {
  Point middle;  ///< map frame [m]
  double leverage = 0.0;
};

/// What fixes the poses of recorded scans.
struct Contributions {
  /// Of the scans whose poses are in a region, and of the elements of its map.
  struct Part {
    RegionId region;
    std::size_t scans = 0;
    std::vector<Contribution> elements;  ///< those that a scan has a point in
    double elsewhere = 0.0;              ///< of the others, whose middles nothing tells
  };
  std::string matcher;           ///< its name
  std::vector<Part> parts;       ///< each with a scan, in the order of their regions
  std::size_t without_pose = 0;  ///< scans that the reference has no pose for
  std::size_t outside = 0;       ///< scans that are in no region with a map
  std::size_t loose = 0;         ///< scans whose poses the map does not fix

  /// The number of scans that count, in one region or in all.
  [[nodiscard]] std::size_t scans(const std::optional<RegionId>& region) const;
  /// The sum of the leverages that have no place.
  [[nodiscard]] double elsewhere(const std::optional<RegionId>& region) const;
  /// The elements of one region's map, or of all maps, in the order of their places. Those in
  /// one place, a cube of 1 cm, count as one: several maps have the same element.
  [[nodiscard]] std::vector<Contribution> elements(const std::optional<RegionId>& region) const;
};

/// The matcher that a bundle was built with: that of prepared maps, or else that of the atlas.
/// Errors: `not_found` if the bundle has neither.
[[nodiscard]] Result<PluginChoice> matcher_of(const Bundle& bundle,
                                              const std::optional<Atlas>& atlas);

/// Takes each scan at its pose in the reference, undistorted and thinned as a localizer does, and
/// sums up what the elements of the map of its region do. Holds the map of one region at a time.
/// Precondition: there is a reference.
/// Errors: those of the scans, of the store and of the matcher; `unsupported` for a matcher that
/// does not tell what its elements do; `invalid_input`, with the reasons, if no scan counts.
[[nodiscard]] Result<Contributions> contributions_to(const RunInputs& inputs, const Bundle& bundle,
                                                     const PluginChoice& matcher,
                                                     const PluginLoader& plugins,
                                                     const ScanProgress& progress = {});

/// The sum of the largest leverages.
/// @param part  so many of the elements, 0 .. 1
[[nodiscard]] double strongest(std::span<const Contribution> elements, double part);

}  // namespace vantage::view
