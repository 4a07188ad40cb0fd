#pragma once

#include <nlohmann/json_fwd.hpp>

#include "evaluate/evaluation.hpp"

namespace vantage {

/// summary.json: every configuration with its region maps, its runs, those of its opponents, and
/// its gates.
[[nodiscard]] nlohmann::ordered_json to_json(const Evaluation& evaluation);

}  // namespace vantage
