#include "vantage/evaluation/summary.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "evaluation/degrees.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage {
namespace {

// The columns after those of the metrics: the way, whether the scan is compared with others, and
// the true and the estimated pose, each 7 numbers.
enum Place : std::size_t {
  kWay,
  kCompared,
  kTruth,
  kEstimate = kTruth + 7,
  kPlaces = kEstimate + 7
};

std::size_t column_of(std::size_t place) { return metrics().size() + place; }

Result<void> push(ColumnSpool& values, std::size_t place, const Pose& pose) {
  const auto& [q, t] = pose;
  for (const double x : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    VANTAGE_CHECK(values.push(column_of(place++), x));
  }
  return {};
}

Result<Pose> pose_at(ColumnSpool::Reader& values, std::size_t place, std::size_t row) {
  std::array<double, 7> x{};
  for (double& number : x) {
    VANTAGE_TRY(number, values.at(column_of(place++), row));
  }
  return Pose{Eigen::Quaterniond(x[6], x[3], x[4], x[5]), {x[0], x[1], x[2]}};
}

}  // namespace

void RunSummarizer::WithinSigmas::add(const RunScan& scan, Eigen::Vector3d PoseError::*error,
                                      Eigen::Index first) {
  if (!is_tracked(scan) || !scan.error || !scan.report.confidence) return;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double sigma = std::sqrt(scan.report.confidence->covariance(first + axis, first + axis));
    const double size = std::abs(((*scan.error).*error)[axis]);
    ++errors;
    for (std::size_t k = 0; k < 3; ++k) {
      if (size <= static_cast<double>(k + 1) * sigma) ++within[k];
    }
  }
}

std::array<double, 3> RunSummarizer::WithinSigmas::shares() const {
  std::array<double, 3> shares{};
  const auto all = static_cast<double>(std::max<std::size_t>(errors, 1));
  for (std::size_t k = 0; k < 3; ++k) shares[k] = static_cast<double>(within[k]) / all;
  return shares;
}

void RunSummarizer::Predictions::add(const RunScan& scan) {
  constexpr double kWidth = 10.0;  // of a place [m]
  if (!is_tracked(scan) || !scan.error || !scan.predicted) return;
  const double error = scan.error->metres, expected = scan.predicted->expected,
               promised = scan.predicted->error;
  if (!std::isfinite(expected) || !std::isfinite(promised)) {
    ++unpromised_;
    return;
  }
  ++errors_;
  if (error <= promised) ++kept_;
  const Point at = scan.reference->translation / kWidth;
  Place& place = places_[{static_cast<std::int64_t>(std::floor(at.x())),
                          static_cast<std::int64_t>(std::floor(at.y()))}];
  place.expected += expected * expected;
  place.measured += error * error;
  ++place.errors;
}

std::optional<PredictionsMet> RunSummarizer::Predictions::met() const {
  constexpr std::size_t kFewest = 10;
  if (errors_ + unpromised_ == 0) return std::nullopt;
  std::vector<double> expected, measured;
  for (const auto& [at, place] : places_) {
    if (place.errors < kFewest) continue;
    const auto n = static_cast<double>(place.errors);
    expected.push_back(std::sqrt(place.expected / n));
    measured.push_back(std::sqrt(place.measured / n));
  }
  return PredictionsMet{.errors = errors_,
                        .kept = kept_,
                        .unpromised = unpromised_,
                        .places = expected.size(),
                        .rank_correlation = rank_correlation(expected, measured)};
}

RunSummarizer::RunSummarizer(std::optional<std::filesystem::path> folder)
    : values_(column_of(kPlaces), std::move(folder)) {}

Result<void> RunSummarizer::add(const RunScan& scan) {
  const auto table = metrics();
  for (std::size_t k = 0; k < table.size(); ++k) {
    if (scans_ == 0 && table[k].is(kAfterFirst)) continue;
    if (const auto x = counted_value(table[k], scan)) VANTAGE_CHECK(values_.push(k, *x));
  }
  const bool compared = is_tracked(scan) && scan.reference.has_value();
  VANTAGE_CHECK(values_.push(column_of(kWay), odometer_(scan)));
  VANTAGE_CHECK(values_.push(column_of(kCompared), compared ? 1.0 : 0.0));
  VANTAGE_CHECK(push(values_, kTruth, scan.reference.value_or(Pose())));
  VANTAGE_CHECK(push(values_, kEstimate, scan.report.T_map_scan));
  ++scans_;
  if (is_tracked(scan)) ++tracked_;
  translation_.add(scan, &PoseError::translation, 0);
  rotation_.add(scan, &PoseError::rotation, 3);
  predictions_.add(scan);
  return {};
}

Result<RelativeErrors> RunSummarizer::relative_errors(double step) const {
  ColumnSpool::Reader first(values_), second(values_);
  std::vector<double> m, deg;
  for (std::size_t i = 0, j = 1; i + 1 < scans_; ++i) {
    VANTAGE_TRY(const double begin, first.at(column_of(kWay), i));
    for (j = std::max(j, i + 1); j < scans_; ++j) {
      VANTAGE_TRY(const double end, second.at(column_of(kWay), j));
      if (end - begin >= step) break;
    }
    if (j == scans_) break;
    VANTAGE_TRY(const double from, first.at(column_of(kCompared), i));
    VANTAGE_TRY(const double to, second.at(column_of(kCompared), j));
    if (from == 0.0 || to == 0.0) continue;
    const auto motion = [&](std::size_t place) -> Result<Pose> {
      VANTAGE_TRY(const Pose before, pose_at(first, place, i));
      VANTAGE_TRY(const Pose after, pose_at(second, place, j));
      return before.inverse() * after;
    };
    VANTAGE_TRY(const Pose truth, motion(kTruth));
    VANTAGE_TRY(const Pose estimate, motion(kEstimate));
    m.push_back((truth.inverse() * estimate).translation.norm());
    deg.push_back(rotation_between(truth, estimate) * kDegrees);
  }
  return RelativeErrors{.m = statistics_of(m), .deg = statistics_of(deg)};
}

Result<RunSummary> RunSummarizer::summary() const {
  RunSummary s;
  s.scans = scans_;
  s.tracked = tracked_;
  for (std::size_t k = 0; k < metrics().size(); ++k) {
    VANTAGE_TRY(const std::vector<double> sample, values_.read(k));
    s.of_metrics.push_back(statistics_of(sample));
  }
  VANTAGE_TRY(s.relative_frame, relative_errors(0.0));
  VANTAGE_TRY(s.relative_10m, relative_errors(10.0));
  s.within_sigmas_translation = translation_.shares();
  s.within_sigmas_rotation = rotation_.shares();
  s.predictions = predictions_.met();
  return s;
}

RunSummary summarize(const Run& run) {
  RunSummarizer summarizer;
  // Nothing of this leaves memory, so nothing of it can fail.
  for (const RunScan& scan : run.scans) static_cast<void>(summarizer.add(scan));
  return *summarizer.summary();
}

Statistics RunSummary::operator[](std::string_view key) const {
  const Metric* metric = find_metric(key);
  const auto at = static_cast<std::size_t>(metric - metrics().data());
  return metric != nullptr && at < of_metrics.size() ? of_metrics[at] : Statistics{};
}

std::size_t RunSummary::count(std::string_view key) const {
  return static_cast<std::size_t>((*this)[key].sum);
}

}  // namespace vantage
