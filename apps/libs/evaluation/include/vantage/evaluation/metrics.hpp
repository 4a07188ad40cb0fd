#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/statistics.hpp"

namespace vantage {

/// What a metric is measured in.
struct MetricUnit {
  struct Size {
    std::string_view name;  ///< "cm"; empty for a plain number
    double size;            ///< in the unit of values and files
  };
  std::string_view shown;        ///< that people read; may be empty
  double scale;                  ///< from the unit of values and files to `shown`
  std::span<const Size> limits;  ///< that gates take
  int digits_in_files;           ///< after the point in scans.csv; -1: as many as it takes
};

enum class Better : std::uint8_t { neither, less, more };

/// Tables show the groups in this order.
enum class MetricGroup : std::uint8_t { error, map, scans, time, match };

/// What else is to be known of a metric, as bits.
enum MetricTrait : unsigned {
  kTrackedOnly = 1U,    ///< statistics and comparisons leave out lost scans
  kNotInFiles = 2U,     ///< no column of scans.csv: another column says the same
  kOwnMaps = 4U,        ///< says nothing of baselines, whose maps are made while driving
  kNeedsPoints = 8U,    ///< not known of a bundle that stores no points
  kAfterFirst = 16U,    ///< does not count at the first scan of a run
  kShareOfScans = 32U,  ///< a number of scans, of which the share can be told
};

/// A number that is measured of every scan: a row of the table that scans.csv, summary.json, the
/// terminal, the report, the diagnostics of --mcap, gates, `vantage compare` and docs/files.md are
/// made from.
struct Metric {
  /// Its name everywhere, with the unit of its values. Gates leave the unit out: "error=1cm" is a
  /// limit of `error_m`.
  std::string_view key;
  std::string_view name;  ///< in headings, without its unit
  const MetricUnit* unit;
  int digits;  ///< after the point, in the unit shown
  Better better;
  MetricGroup group;
  /// Statistics that tables show (named_statistics); the first stands for a run.
  std::string_view statistics;
  /// Those in the terminal's table of `vantage evaluate`, which has little room; may be empty.
  std::string_view brief;
  std::string_view doc;  ///< Markdown, without a full stop
  /// Of a scan, in the unit of the key; none if there is nothing to measure.
  std::optional<double> (*value)(const RunScan&);
  unsigned traits = 0;  ///< MetricTrait

  [[nodiscard]] bool is(MetricTrait trait) const { return (traits & trait) != 0; }
  /// Added up over a run instead of averaged.
  [[nodiscard]] bool is_count() const { return statistics == "sum"; }
};

/// All of them, in the order of scans.csv.
[[nodiscard]] std::span<const Metric> metrics();
/// In the order of tables.
[[nodiscard]] std::vector<const Metric*> metrics_by_group();
/// nullptr if there is none.
[[nodiscard]] const Metric* find_metric(std::string_view key);

/// "error [cm]".
[[nodiscard]] std::string heading(const Metric& metric);
/// A value as people read it, without its unit.
[[nodiscard]] std::string shown(const Metric& metric, double value);
/// "error" of "error_m".
[[nodiscard]] std::string_view name_in_gates(const Metric& metric);

struct NamedStatistic {
  std::string_view name;  ///< "p95"
  double Statistics::*member;
};
/// mean, rmse, std, min, median, p95, p99, max and sum.
[[nodiscard]] std::span<const NamedStatistic> named_statistics();
/// The statistics of a list such as "mean p95". Precondition: every name is one.
[[nodiscard]] std::vector<NamedStatistic> statistics_in(std::string_view names);
/// The one that stands for a run.
[[nodiscard]] NamedStatistic headline(const Metric& metric);

}  // namespace vantage
