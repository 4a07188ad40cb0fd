#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "integrity_worlds.hpp"
#include "vantage/engine/atlas.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/result.hpp"

namespace vantage::benchmarks {

/// A scan of a drive that was localized.
struct Localized {
  const Site* site;  ///< the nearest
  double away;       ///< from it [m]
  double error;      ///< horizontal [m]
  std::size_t drive;
};

/// Localizes a drive. A localizer that is lost begins again: where it is lost says something about
/// that place, and nothing about the next one.
[[nodiscard]] Result<std::vector<Localized>> localized(const Atlas& atlas, Localizer localizer,
                                                       const SimulatedDrive& drive,
                                                       std::size_t number);

/// A site and root mean squares of the errors around it [m]; none if too few scans were taken
/// there.
struct Place {
  Site site;
  std::optional<double> predicted = {};
  std::optional<double> on_lane = {};            ///< where the viewpoints come from
  std::optional<double> beside = {};             ///< on the other lane
  std::optional<double> first = {}, again = {};  ///< of two drives on the lane
  std::optional<double> at_site = {};            ///< of the scan of each drive next to the site
  std::optional<double> elsewhere = {};          ///< of the others
};

/// The places of an atlas at which something matched.
/// @param scans  of all drives; those of even number are on the lane of the viewpoints
[[nodiscard]] std::vector<Place> places_of(const Atlas& atlas, const std::vector<Localized>& scans);

using Errors = std::vector<std::optional<double>>;
[[nodiscard]] Errors errors_of(const std::vector<Place>& places,
                               std::optional<double> Place::*which);

/// Spearman's rank correlation of the places that have both; "-" if they are fewer than three.
[[nodiscard]] std::string correlation(const Errors& a, const Errors& b);

}  // namespace vantage::benchmarks
