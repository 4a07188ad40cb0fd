#include "evaluate/summary.hpp"

#include <nlohmann/json.hpp>

namespace vantage {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const GateResult& result) {
  return {{"gate", result.gate.text},
          {"route", result.route.empty() ? Json() : Json(result.route)},
          {"value", result.value ? Json(*result.value) : Json()},
          {"holds", result.holds}};
}

Json to_json(const EvaluatedConfig& config, const std::vector<Route>& routes) {
  Json json{{"name", config.name},
            {"config", config.routes.front().run.config},
            {"map_points", config.index.map_points},
            {"regions", config.index.partition.size()},
            {"points_per_region", cli::to_json(config.region_points)},
            {"reduction", config.reduction()},
            {"bytes", config.bundle_bytes},
            {"routes", Json::array()}};
  for (std::size_t r = 0; r < routes.size(); ++r) {
    Json run{{"route", routes[r].name}};
    run.update(vantage::to_json(config.routes[r].run, config.routes[r].summary));
    for (const Opponent& opponent : config.opponents) {
      run["opponents"][opponent.name] =
          vantage::to_json(opponent.routes[r].run, opponent.routes[r].summary);
    }
    json["routes"].push_back(std::move(run));
  }
  if (!config.no_opponents.empty()) json["no_opponents"] = config.no_opponents;
  if (const auto passed = config.passed()) {
    json["passed"] = *passed;
    for (const GateResult& gate : config.gates) json["gates"].push_back(to_json(gate));
  }
  return json;
}

}  // namespace

Json to_json(const Evaluation& evaluation) {
  Json json{{"routes", Json::array()}, {"configs", Json::array()}};
  for (const Route& route : evaluation.routes) json["routes"].push_back(route.name);
  for (const EvaluatedConfig& config : evaluation.configs) {
    json["configs"].push_back(to_json(config, evaluation.routes));
  }
  return json;
}

}  // namespace vantage
