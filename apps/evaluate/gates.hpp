#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "vantage/result.hpp"

namespace vantage {

struct EvaluatedConfig;
struct RouteRun;

/// A limit that a configuration has to keep on every route.
struct Gate {
  std::string text;       ///< as it was given: "error=0.5cm"
  std::string metric;     ///< "error"
  double limit = 0.0;     ///< in the metric's own unit
  bool at_least = false;  ///< the value must not be below the limit, instead of not above it
};

struct GateResult {
  Gate gate;
  std::string route;
  double value = 0.0;  ///< in the metric's own unit; NaN where nothing could be measured
  bool holds = false;  ///< false for NaN
};

/// Reads "error=0.5cm,lost=0,coverage=90%": limits of metrics, `=` in the direction that is better,
/// `<=` and `>=` where that is to be said.
/// Errors: `invalid_input` that names the gate, for an unknown metric, unit or number.
[[nodiscard]] Result<std::vector<Gate>> parse_gates(std::string_view text);

/// A line for each metric: its name, unit, what is better, what it means.
[[nodiscard]] std::string gate_help();

[[nodiscard]] GateResult judge(const Gate& gate, const EvaluatedConfig& config, const RouteRun& run,
                               std::string route);

/// "0.42 cm": a value of a gate's metric with its unit.
[[nodiscard]] std::string value_text(const Gate& gate, double value);

}  // namespace vantage
