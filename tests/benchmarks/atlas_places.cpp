#include "atlas_places.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "vantage/evaluation/statistics.hpp"

namespace vantage::benchmarks {
namespace {

bool is_on_lane(const Localized& scan) { return scan.drive % 2 == 0; }

}  // namespace

Result<std::vector<Localized>> localized(const Atlas& atlas, Localizer localizer,
                                         const SimulatedDrive& drive, std::size_t number) {
  constexpr double kLost = 2.0;  // [m]
  std::vector<Localized> scans;
  bool is_lost = true;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    const Pose& truth = drive.reference[i].pose;
    if (is_lost) VANTAGE_CHECK(localizer.start(truth));
    const double stamp = drive.reference[i].stamp;
    VANTAGE_CHECK(localizer.add(OdometrySample{stamp, drive.odometry[i].pose}));
    VANTAGE_TRY(const ScanReport report, localizer.localize(drive.scan(i)));
    const double error = (report.T_map_scan.translation - truth.translation).head<2>().norm();
    is_lost = !report.has_pose || error > kLost;
    if (!report.has_pose) continue;
    const Site* const site = atlas.nearest(truth.translation);
    scans.push_back({site, (site->position - truth.translation).norm(), error, number});
  }
  return scans;
}

std::vector<Place> places_of(const Atlas& atlas, const std::vector<Localized>& scans) {
  constexpr std::size_t kFewestScans = 5;
  std::vector<Place> places;
  for (const Site& site : atlas.sites) {
    if (!site.precision) continue;
    std::map<std::size_t, const Localized*> next_to;  // by drive
    for (const Localized& scan : scans) {
      if (scan.site != &site) continue;
      const Localized*& nearest = next_to[scan.drive];
      if (nearest == nullptr || scan.away < nearest->away) nearest = &scan;
    }
    const auto is_next = [&](const Localized& scan) { return next_to[scan.drive] == &scan; };
    const auto error_of = [&](const auto& which, std::size_t fewest) -> std::optional<double> {
      double squares = 0.0;
      std::size_t n = 0;
      for (const Localized& scan : scans) {
        if (scan.site != &site || !which(scan)) continue;
        squares += scan.error * scan.error;
        ++n;
      }
      if (n < fewest) return {};
      return std::sqrt(squares / static_cast<double>(n));
    };
    const auto of_drive = [](std::size_t drive) {
      return [drive](const Localized& scan) { return scan.drive == drive; };
    };
    places.push_back(
        {.site = site,
         .predicted = site.precision->expected_error,
         .on_lane = error_of(is_on_lane, kFewestScans),
         .beside = error_of(std::not_fn(is_on_lane), kFewestScans),
         .first = error_of(of_drive(0), kFewestScans),
         .again = error_of(of_drive(2), kFewestScans),
         .at_site = error_of([&](const auto& s) { return is_on_lane(s) && is_next(s); }, 1),
         .elsewhere =
             error_of([&](const auto& s) { return is_on_lane(s) && !is_next(s); }, kFewestScans)});
  }
  return places;
}

Errors errors_of(const std::vector<Place>& places, std::optional<double> Place::*which) {
  Errors errors;
  for (const Place& place : places) errors.push_back(place.*which);
  return errors;
}

std::string correlation(const Errors& a, const Errors& b) {
  std::vector<double> x, y;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (!a[k] || !b[k]) continue;
    x.push_back(*a[k]);
    y.push_back(*b[k]);
  }
  return x.size() < 3 ? "-" : fmt::format("{:.2f}", rank_correlation(x, y));
}

}  // namespace vantage::benchmarks
