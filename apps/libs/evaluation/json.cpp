#include "evaluation/json.hpp"

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
            {"points_per_region", vantage::to_json(config.region_points)},
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

Json to_json(const Statistics& s) {
  return {{"count", s.count},   {"mean", s.mean}, {"rmse", s.rmse}, {"std", s.std}, {"min", s.min},
          {"median", s.median}, {"p95", s.p95},   {"p99", s.p99},   {"max", s.max}};
}

Json to_json(const Run& run, const RunSummary& s) {
  Json json{{"config", run.config},
            {"stamps", run.stamp_rule},
            {"map", {{"points", run.index.map_points}, {"regions", run.index.partition.size()}}},
            {"scans",
             {{"total", s.scans},
              {"tracked", s.tracked},
              {"lost", s.lost},
              {"recovered", s.recovered},
              {"outside_every_region", s.outside},
              {"switches", s.switches},
              {"blocking_loads", s.blocking_loads},
              {"dropped_points", s.dropped_points},
              {"skipped",
               {{"not_later", run.skipped.not_later}, {"incomplete", run.skipped.incomplete}}}}},
            {"T_align_ms", vantage::to_json(s.align_ms)},
            {"stall_ms", vantage::to_json(s.stall_ms)},
            {"search_ms", vantage::to_json(s.search_ms)},
            {"T_load_ms", vantage::to_json(s.load_ms)},
            {"T_prepare_ms", vantage::to_json(s.prepare_ms)},
            {"held_bytes_max", s.held_bytes},
            {"N_point", vantage::to_json(s.map_points)},
            {"iterations", vantage::to_json(s.iterations)},
            {"fitness", vantage::to_json(s.fitness)},
            {"NVTL", vantage::to_json(s.nvtl)},
            {"coverage", vantage::to_json(s.coverage)},
            {"LCP", vantage::to_json(s.lcp)},
            {"sigma_m", vantage::to_json(s.sigma_m)}};
  if (run.speed) {
    json["replay"] = {{"speed", *run.speed}, {"late_ms_max", 1e3 * run.seconds_late}};
  }
  if (s.error_m.count > 0) {
    json["error_m"] = vantage::to_json(s.error_m);
    json["error_deg"] = vantage::to_json(s.error_deg);
    const auto relative = [](const RelativeErrors& r) {
      return Json{{"m", vantage::to_json(r.m)}, {"deg", vantage::to_json(r.deg)}};
    };
    json["relative_error"] = {{"next_scan", relative(s.relative_frame)},
                              {"10m", relative(s.relative_10m)}};
    json["scans_beyond_2m_or_5deg"] = s.far_off;
    json["tracked_scans_beyond_2m_or_5deg"] = s.tracked_far_off;
    json["errors_within_1_2_3_sigma"] = {{"translation", s.within_sigmas_translation},
                                         {"rotation", s.within_sigmas_rotation}};
  }
  return json;
}

Json to_json(const Comparison& c) {
  Json json{{"a", c.a.file.string()},          {"b", c.b.file.string()},
            {"scans_in_both", c.pairs.size()}, {"stamps_only_in_a", c.only_a},
            {"stamps_only_in_b", c.only_b},    {"lost", c.lost},
            {"switches", c.switches},          {"blocking_loads", c.blocking}};
  for (const Compared& q : c.quantities) {
    json["quantities"][q.column] = {{"unit", q.unit},
                                    {"scans", q.pairs.size()},
                                    {"mean_a", q.mean_a},
                                    {"mean_b", q.mean_b},
                                    {"difference", q.difference},
                                    {"interval_95", {q.interval.low, q.interval.high}},
                                    {"share_b_better", *q.share_better}};
  }
  return json;
}

Json to_json(const Evaluation& evaluation) {
  Json json{{"routes", Json::array()}, {"configs", Json::array()}};
  for (const Route& route : evaluation.routes) json["routes"].push_back(route.name);
  for (const EvaluatedConfig& config : evaluation.configs) {
    json["configs"].push_back(to_json(config, evaluation.routes));
  }
  return json;
}

}  // namespace vantage
