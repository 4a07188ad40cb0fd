#pragma once

#include <nlohmann/json.hpp>

#include "vantage/evaluation/comparison.hpp"
#include "vantage/evaluation/evaluation.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/statistics.hpp"
#include "vantage/evaluation/summary.hpp"

namespace vantage {

[[nodiscard]] nlohmann::ordered_json to_json(const Statistics& statistics);
/// summary.json of a run.
[[nodiscard]] nlohmann::ordered_json to_json(const RunInfo& run, const RunSummary& summary);
/// summary.json of `vantage evaluate`: every configuration with its region maps, its runs, its
/// baselines' runs, and its gates.
[[nodiscard]] nlohmann::ordered_json to_json(const Evaluation& evaluation);
[[nodiscard]] nlohmann::ordered_json to_json(const Comparison& comparison);

}  // namespace vantage
