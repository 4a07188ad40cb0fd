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

/// The unit of a metric.
struct MetricUnit {
  struct Size {
    std::string_view name;  ///< "cm"; empty for a plain number
    double size;            ///< of one such unit, in the unit of values and files
  };
  std::string_view shown;        ///< the unit that people read; may be empty
  double scale;                  ///< factor from the unit of values and files to `shown`
  std::span<const Size> limits;  ///< units that gates accept
  int digits_in_files;           ///< decimals in scans.csv; -1: as many as needed
};

enum class Better : std::uint8_t { neither, less, more };

/// Groups of metrics, in the order of tables.
enum class MetricGroup : std::uint8_t { error, map, scans, time, match };

/// Further properties of a metric, as bits.
enum MetricTrait : unsigned {
  kTrackedOnly = 1U,     ///< statistics and comparisons leave out scans that are not tracked
  kNotInFiles = 2U,      ///< no column of scans.csv: other columns say the same
  kOwnMaps = 4U,         ///< no meaning for baselines: their maps are made during the run
  kNeedsPoints = 8U,     ///< unknown for a bundle without points
  kAfterFirst = 16U,     ///< the first scan of a run does not count
  kNotInOldFiles = 32U,  ///< scans.csv of earlier versions has no such column
  kSignificant = 64U,    ///< `digits` is the number of significant digits
};

/// A number that is measured for every scan. The metrics form one table. scans.csv, summary.json,
/// the terminal, the report, the diagnostics of --mcap, gates, `vantage compare` and docs/files.md
/// are all made from it.
struct Metric {
  /// Its name in files and code; ends with the unit of its values, if any. Gates leave the unit
  /// out: "error=1cm" is a limit of `error_m`.
  std::string_view key;
  std::string_view name;  ///< in headings, without the unit
  const MetricUnit* unit;
  int digits;  ///< decimals, in the unit shown; see kSignificant
  Better better;
  MetricGroup group;
  /// Statistics that tables show (see named_statistics); the first represents a run.
  std::string_view statistics;
  /// The few statistics in the terminal table of `vantage evaluate`; may be empty.
  std::string_view brief;
  std::string_view doc;  ///< Markdown, without a full stop
  /// The value for a scan, in the unit of the key; none if there is nothing to measure.
  std::optional<double> (*value)(const RunScan&);
  unsigned traits = 0;  ///< MetricTrait
  /// The scans that have a value, in words, if the metric counts some of them: gates can also limit
  /// their share. Otherwise empty.
  std::string_view counted_of = {};

  [[nodiscard]] bool is(MetricTrait trait) const { return (traits & trait) != 0; }
  /// Whether values are added up over a run instead of averaged.
  [[nodiscard]] bool is_count() const { return statistics == "sum"; }
};

/// All metrics, in the order of scans.csv.
[[nodiscard]] std::span<const Metric> metrics();
/// All metrics, in the order of tables.
[[nodiscard]] std::vector<const Metric*> metrics_by_group();
/// The value of a scan that counts in statistics; none for a scan that is not tracked if the metric
/// is kTrackedOnly.
[[nodiscard]] std::optional<double> counted_value(const Metric& metric, const RunScan& scan);
/// Finds a metric by its key; returns nullptr if there is none.
[[nodiscard]] const Metric* find_metric(std::string_view key);

/// Name and unit: "error [cm]".
[[nodiscard]] std::string heading(const Metric& metric);
/// A value in the unit that people read, without the name of the unit.
[[nodiscard]] std::string shown(const Metric& metric, double value);
/// The same for a value that is in the unit that people read.
[[nodiscard]] std::string rounded(const Metric& metric, double value);
/// The key without its unit: "error" for "error_m".
[[nodiscard]] std::string_view name_in_gates(const Metric& metric);

struct NamedStatistic {
  std::string_view name;  ///< "p95"
  double Statistics::*member;
};
/// mean, rmse, std, min, median, p95, p99, max and sum.
[[nodiscard]] std::span<const NamedStatistic> named_statistics();
/// The statistics in a list such as "mean p95". Precondition: every name is known.
[[nodiscard]] std::vector<NamedStatistic> statistics_in(std::string_view names);
/// The statistic that represents a run.
[[nodiscard]] NamedStatistic headline(const Metric& metric);

}  // namespace vantage
