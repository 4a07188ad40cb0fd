#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "report/html.hpp"
#include "vantage/evaluation/evaluation.hpp"

namespace vantage::page {

inline constexpr std::string_view kOwnMap = "observable";

/// A configuration's own maps or an baseline's, on one route.
struct MapRun {
  const EvaluatedConfig* config;
  std::size_t config_number;
  std::string_view map;  ///< kOwnMap or the baseline's name
  std::size_t route;
  const RouteRun* run;

  [[nodiscard]] bool own() const { return map == kOwnMap; }
};

/// All of one route: each configuration, its baselines after it.
[[nodiscard]] std::vector<MapRun> runs_of(const Evaluation& evaluation, std::size_t route);

[[nodiscard]] std::string verdict(const Evaluation& evaluation);
[[nodiscard]] std::string points_table(const Evaluation& evaluation);
[[nodiscard]] std::string accuracy_tables(const Evaluation& evaluation);
[[nodiscard]] std::string method(const Evaluation& evaluation);

}  // namespace vantage::page
