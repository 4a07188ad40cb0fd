#include "vantage/io/pose_priors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

namespace vantage::io {
namespace {

Result<void> check(const PriorSigmas& sigmas, const std::string& file) {
  const std::array all{sigmas.horizontal, sigmas.vertical, sigmas.heading};
  const bool positive = std::all_of(all.begin(), all.end(), [](double s) { return s > 0.0; });
  const bool some = std::any_of(all.begin(), all.end(), [](double s) { return std::isfinite(s); });
  if (positive && some) return {};
  return fail(ErrorCode::invalid_input,
              fmt::format("the sigmas of the prior are {} m, {} m and {} rad, expected numbers "
                          "above 0, at least one of them finite",
                          sigmas.horizontal, sigmas.vertical, sigmas.heading),
              SourceLocation{file, 0, 0});
}

PosePrior prior_of(const Pose& pose, const PriorSigmas& sigmas) {
  return {.T_map_sensor = pose,
          .sigma_translation = {sigmas.horizontal, sigmas.horizontal, sigmas.vertical},
          .sigma_heading = sigmas.heading};
}

}  // namespace

Result<PosePriors> read_priors(const PriorSource& source, const SensorFrame& sensor) {
  const PriorSigmas sigmas = source.sigmas.value_or(PriorSigmas{});
  VANTAGE_CHECK(check(sigmas, source.path.string()));
  VANTAGE_TRY(const auto poses,
              read_sensor_trajectory({source.path, source.topic, source.rate_hz}, sensor));
  PosePriors found{.priors = {}, .source = source.path.string()};
  for (const StampedPose& moment : poses) {
    found.priors.push_back({moment.stamp, prior_of(moment.pose, sigmas)});
  }
  return found;
}

std::optional<PosePrior> prior_at(const PosePriors& priors, double stamp, double max_gap_s) {
  const auto& all = priors.priors;
  const auto after =
      std::lower_bound(all.begin(), all.end(), stamp,
                       [](const StampedPrior& prior, double s) { return prior.stamp < s; });
  const StampedPrior* const before = after == all.begin() ? nullptr : &*std::prev(after);
  const StampedPrior* const next = after == all.end() ? nullptr : &*after;
  Trajectory around;
  for (const StampedPrior* measured : {before, next}) {
    if (measured != nullptr) around.push_back({measured->stamp, measured->prior.T_map_sensor});
  }
  const auto pose = pose_at(around, stamp, max_gap_s);
  if (!pose) return std::nullopt;
  const bool is_before =
      next == nullptr || (before != nullptr && stamp - before->stamp <= next->stamp - stamp);
  PosePrior prior = is_before ? before->prior : next->prior;
  prior.T_map_sensor = *pose;
  return prior;
}

}  // namespace vantage::io
