#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "localize/run_page.hpp"

/// The parts of a page of a run, and what they read of its scans.
namespace vantage::run_page {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The metrics that the page draws.
inline constexpr std::array<std::string_view, 11> kDrawn{
    "risk",     "fitness",   "coverage",   "nvtl",       "scan_ms",  "align_ms",
    "stall_ms", "search_ms", "held_bytes", "map_points", "map_bytes"};
/// The columns before theirs.
enum Place : std::size_t { kTime, kWay, kX, kY, kTracking, kRegion, kSwitched, kResident, kPlaces };

inline std::size_t column_of(std::string_view metric) {
  return kPlaces +
         static_cast<std::size_t>(std::find(kDrawn.begin(), kDrawn.end(), metric) - kDrawn.begin());
}

/// The columns that several parts of the page need, a number for each scan.
struct Scans {
  std::vector<double> time, way, tracking;  ///< [s] since the first scan, [m], Tracking

  [[nodiscard]] std::size_t size() const { return time.size(); }
  [[nodiscard]] bool is(std::size_t i, Tracking state) const {
    return tracking[i] == static_cast<double>(state);
  }
};

/// Reads a column.
using ColumnReader = std::function<Result<std::vector<double>>(std::size_t)>;

/// @param reasons  why scans were not tracked, and how many
[[nodiscard]] std::string verdict(const RunFacts& facts, const Scans& scans,
                                  const std::map<std::string, std::size_t>& reasons);
[[nodiscard]] Result<std::string> drive(const RunFacts& facts, const Scans& scans,
                                        const ColumnReader& read);
[[nodiscard]] Result<std::string> risk_over_time(const RunFacts& facts, const Scans& scans,
                                                 const ColumnReader& read);
[[nodiscard]] Result<std::string> fit_over_time(const Scans& scans, const ColumnReader& read);
[[nodiscard]] Result<std::string> times(const RunFacts& facts, const Scans& scans,
                                        const ColumnReader& read);
[[nodiscard]] Result<std::string> memory(const Scans& scans, const ColumnReader& read);

}  // namespace vantage::run_page
