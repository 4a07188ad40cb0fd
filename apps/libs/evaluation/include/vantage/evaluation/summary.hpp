#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "vantage/evaluation/column_spool.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/statistics.hpp"

namespace vantage {

/// How far the estimated motion between two scans is from the true one: the translation and the
/// rotation angle of (true motion)^-1 * (estimated motion).
struct RelativeErrors {
  Statistics m, deg;
};

/// How the errors of tracked scans compare with what their maps promise.
struct PredictionsMet {
  std::size_t errors = 0, kept = 0;  ///< and of those, errors that keep the promise
  std::size_t unpromised = 0;        ///< further errors, where the elements do not hold a pose
  std::size_t places = 0;            ///< squares of 10 m with 10 errors or more
  double rank_correlation = 0.0;     ///< over them, of expected and measured root mean squares
};

/// The numbers of a run that people compare.
struct RunSummary {
  std::size_t scans = 0, tracked = 0;
  std::vector<Statistics> of_metrics = {};  ///< one for each of metrics()
  RelativeErrors relative_frame;            ///< from each scan to the next; both tracked
  RelativeErrors relative_10m;  ///< to the first scan 10 m on along the reference; both tracked
  /// Share of the errors along map axes within 1, 2 and 3 of the standard deviations claimed.
  std::array<double, 3> within_sigmas_translation{}, within_sigmas_rotation{};

  std::optional<PredictionsMet> predictions = {};  ///< none without errors or predictions

  /// The statistics of the metric with this key, over the scans that have a value; empty if there
  /// is no such metric.
  [[nodiscard]] Statistics operator[](std::string_view key) const;
  /// The sum of a metric that counts scans or points.
  [[nodiscard]] std::size_t count(std::string_view key) const;
};

/// Makes the summary of a run scan by scan. It keeps the numbers in a ColumnSpool; `summary` then
/// reads those of one metric at a time.
class RunSummarizer {
 public:
  /// @param folder  see ColumnSpool
  explicit RunSummarizer(std::optional<std::filesystem::path> folder = {});

  /// Errors: those of ColumnSpool.
  [[nodiscard]] Result<void> add(const RunScan& scan);
  /// Errors: those of ColumnSpool.
  [[nodiscard]] Result<RunSummary> summary() const;

 private:
  /// How many errors along the axes are within 1, 2 and 3 of the standard deviations claimed.
  struct WithinSigmas {
    std::array<std::size_t, 3> within{};
    std::size_t errors = 0;
    void add(const RunScan& scan, Eigen::Vector3d PoseError::*error, Eigen::Index first);
    [[nodiscard]] std::array<double, 3> shares() const;
  };
  /// The predicted and measured errors of the scans, place by place.
  class Predictions {
   public:
    void add(const RunScan& scan);
    [[nodiscard]] std::optional<PredictionsMet> met() const;

   private:
    struct Place {
      double expected = 0.0, measured = 0.0;  // sums of squares [m^2]
      std::size_t errors = 0;
    };
    std::map<std::array<std::int64_t, 2>, Place> places_;
    std::size_t errors_ = 0, kept_ = 0, unpromised_ = 0;
  };
  /// @param step  distance along the reference's path between the scans that are compared [m]; 0:
  ///              the next scan
  [[nodiscard]] Result<RelativeErrors> relative_errors(double step) const;

  Odometer odometer_;
  ColumnSpool values_;  // of each metric, and then of the way and the poses
  std::size_t scans_ = 0, tracked_ = 0;
  WithinSigmas translation_, rotation_;
  Predictions predictions_;
};

/// The summary of a run that is in memory.
[[nodiscard]] RunSummary summarize(const Run& run);

}  // namespace vantage
