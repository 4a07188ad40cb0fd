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
  std::string text;       ///< as the user wrote it: "error=0.5cm"
  std::string config;     ///< the configuration it applies to; empty: all
  std::string metric;     ///< without unit, maybe with a statistic: "error", "error_p95"
  std::string unit;       ///< "cm"; empty for a plain number
  double limit = 0.0;     ///< in that unit
  bool at_least = false;  ///< true: value >= limit; false: value <= limit
};

struct GateResult {
  Gate gate;
  std::string route;                 ///< empty for a value of the maps, the same on every route
  std::optional<double> value = {};  ///< in the gate's unit; none if there is nothing to measure
  bool holds = false;                ///< false if there is no value
};

/// Reads limits of metrics: "error=0.5cm,lost=0,coverage=90%". `=` means `<=`, or `>=` for metrics
/// that are better when larger. "L20:error=0.5cm,lost=0" applies to the configuration L20 alone.
/// Errors: `invalid_input` for an unknown metric or unit, or a bad number. The message names the
/// gate and says what was expected.
[[nodiscard]] Result<std::vector<Gate>> parse_gates(std::string_view text);

/// One line per metric: its name, `<=` or `>=` (what `=` means), its units and its meaning.
[[nodiscard]] std::string gate_help();

/// Checks that every gate for a configuration can be measured on its bundle.
/// Errors: `invalid_input`, naming the gate, if a gate needs points and the bundle stores none.
[[nodiscard]] Result<void> check_measurable(const std::vector<Gate>& gates,
                                            const std::string& config, const MapIndex& index);

/// Judges a configuration by all gates that apply to it, on all its routes.
/// @param excess_over  the configuration `excess` compares with; nullptr: `excess` has no value
[[nodiscard]] std::vector<GateResult> judge(const std::vector<Gate>& gates,
                                            const EvaluatedConfig& config,
                                            const std::vector<std::string>& routes,
                                            const EvaluatedConfig* excess_over);

/// "0.42 cm", or "not measured".
[[nodiscard]] std::string value_text(const GateResult& result);
/// "error 0.42 cm <= 0.5 cm on route_0".
[[nodiscard]] std::string to_string(const GateResult& result);

}  // namespace vantage
