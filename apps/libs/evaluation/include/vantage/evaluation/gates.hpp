#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage {

struct EvaluatedConfig;
struct RouteRun;

/// A limit that a configuration must keep on every route.
struct Gate {
  std::string text;       ///< as it was given: "error=0.5cm"
  std::string config;     ///< that it is for; empty: all
  std::string metric;     ///< "error": a metric without its unit, maybe with a statistic
  std::string unit;       ///< "cm"; empty for a plain number
  double limit = 0.0;     ///< in that unit
  bool at_least = false;  ///< the value must not be below the limit, instead of not above it
};

struct GateResult {
  Gate gate;
  std::string route;                 ///< empty: the value belongs to the maps, whatever the route
  std::optional<double> value = {};  ///< in the gate's unit; none if there is nothing to measure
  bool holds = false;                ///< false without a value
};

/// Reads "error=0.5cm,lost=0,coverage=90%": limits of metrics. `=` means `<=`, or `>=` for metrics
/// that are better when larger. "L20:error=0.5cm,lost=0" applies to the configuration L20 alone.
/// Errors: `invalid_input` for an unknown metric, unit or number; the message names the gate and
/// says what was expected.
[[nodiscard]] Result<std::vector<Gate>> parse_gates(std::string_view text);

/// One line per metric: its name, which limit `=` means, its units, and what it is.
[[nodiscard]] std::string gate_help();

/// Whether every gate that is for a configuration can be measured on its bundle.
/// Errors: `invalid_input` that names the gate, for points that the bundle does not store.
[[nodiscard]] Result<void> check_measurable(const std::vector<Gate>& gates,
                                            const std::string& config, const MapIndex& index);

/// Holds a configuration to all gates that are for it, on all its routes.
/// @param excess_over  what `excess` is measured from; none: `excess` has no value
[[nodiscard]] std::vector<GateResult> judge(const std::vector<Gate>& gates,
                                            const EvaluatedConfig& config,
                                            const std::vector<std::string>& routes,
                                            const EvaluatedConfig* excess_over);

/// "0.42 cm", or "not measured".
[[nodiscard]] std::string value_text(const GateResult& result);
/// "error 0.42 cm <= 0.5 cm on route_0".
[[nodiscard]] std::string to_string(const GateResult& result);

}  // namespace vantage
