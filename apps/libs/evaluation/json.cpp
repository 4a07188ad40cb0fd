#include "evaluation/json.hpp"

#include <nlohmann/json.hpp>
#include <utility>

#include "vantage/evaluation/metrics.hpp"

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
            {"reduction", config.reduction() ? Json(*config.reduction()) : Json()},
            {"bytes", config.bundle_bytes},
            {"routes", Json::array()}};
  for (std::size_t r = 0; r < routes.size(); ++r) {
    Json run{{"route", routes[r].name}};
    run.update(vantage::to_json(config.routes[r].run, config.routes[r].summary));
    for (const Baseline& baseline : config.baselines) {
      run["baselines"][baseline.name] =
          vantage::to_json(baseline.routes[r].run, baseline.routes[r].summary);
    }
    json["routes"].push_back(std::move(run));
  }
  if (!config.no_baselines.empty()) json["no_baselines"] = config.no_baselines;
  if (const auto passed = config.passed()) {
    json["passed"] = *passed;
    for (const GateResult& gate : config.gates) json["gates"].push_back(to_json(gate));
  }
  return json;
}

}  // namespace

Json to_json(const Statistics& s) {
  Json json{{"count", s.count}};
  for (const NamedStatistic& statistic : named_statistics()) {
    if (statistic.name == "sum") continue;  // for counts
    json[std::string(statistic.name)] = s.count > 0 ? Json(s.*statistic.member) : Json();
  }
  return json;
}

Json to_json(const RunInfo& run, const RunSummary& s) {
  Json scans{{"total", s.scans}, {"tracked", s.tracked}}, numbers;
  for (const Metric& metric : metrics()) {
    const Statistics of_metric = s[metric.key];
    const std::string key(metric.key);
    if (metric.is_count()) {
      scans[key] = of_metric.count > 0 ? Json(s.count(metric.key)) : Json();
    } else {
      numbers[key] = vantage::to_json(of_metric);
    }
  }
  scans["skipped"] = {{"not_later", run.skipped.not_later}, {"incomplete", run.skipped.incomplete}};
  Json json{{"config", run.config},
            {"stamps", run.stamp_rule},
            {"map", {{"points", run.map_points}, {"regions", run.regions}}},
            {"alert_limit", {{"m", run.alert_limit.metres}, {"deg", run.alert_limit.degrees}}},
            {"scans", std::move(scans)}};
  json.update(numbers);
  if (run.prior) {
    json["prior"] = {
        {"source", run.prior->source}, {"scans", run.prior->scans}, {"notes", run.prior->notes}};
  }
  if (run.speed) {
    json["replay"] = {{"speed", *run.speed}, {"late_ms_max", 1e3 * run.seconds_late}};
  }
  if (s["error_m"].count > 0) {
    const auto relative = [](const RelativeErrors& r) {
      return Json{{"m", vantage::to_json(r.m)}, {"deg", vantage::to_json(r.deg)}};
    };
    json["relative_error"] = {{"next_scan", relative(s.relative_frame)},
                              {"10m", relative(s.relative_10m)}};
    json["errors_within_1_2_3_sigma"] = {{"translation", s.within_sigmas_translation},
                                         {"rotation", s.within_sigmas_rotation}};
  }
  if (s.predictions) {
    json["predictions"] = {
        {"errors", s.predictions->errors},
        {"kept", s.predictions->kept},
        {"unpromised", s.predictions->unpromised},
        {"places", s.predictions->places},
        {"rank_correlation",
         s.predictions->places > 2 ? Json(s.predictions->rank_correlation) : Json()}};
  }
  return json;
}

Json to_json(const Comparison& c) {
  Json json{{"a", c.a.file.string()},
            {"b", c.b.file.string()},
            {"scans_in_both", c.pairs.size()},
            {"stamps_only_in_a", c.only_a},
            {"stamps_only_in_b", c.only_b}};
  for (const ComparedCount& n : c.counts) json["counts"][std::string(n.metric->key)] = {n.a, n.b};
  for (const Compared& q : c.quantities) {
    json["quantities"][std::string(q.metric->key)] = {
        {"unit", q.metric->unit->shown},
        {"scans", q.pairs.size()},
        {"mean_a", q.mean_a},
        {"mean_b", q.mean_b},
        {"difference", q.difference},
        {"interval_95", {q.interval.low, q.interval.high}},
        {"share_b_better", q.share_better ? Json(*q.share_better) : Json()}};
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
