#include "vantage/evaluation/gates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>

#include "vantage/config_value.hpp"
#include "vantage/evaluation/evaluation.hpp"

namespace vantage {
namespace {

struct Unit {
  std::string_view name;
  double size;  // in the metric's own unit
};
constexpr std::array kLengths{Unit{"m", 1.0}, Unit{"cm", 1e-2}, Unit{"mm", 1e-3}};
constexpr std::array kAngles{Unit{"deg", 1.0}, Unit{"rad", 180.0 / M_PI}};
constexpr std::array kTimes{Unit{"ms", 1.0}, Unit{"s", 1e3}, Unit{"us", 1e-3}};
constexpr std::array kBytes{Unit{"MB", 1e6}, Unit{"kB", 1e3}, Unit{"GB", 1e9}, Unit{"B", 1.0}};
constexpr std::array kShares{Unit{"%", 1e-2}, Unit{"", 1.0}};
constexpr std::array kPercents{Unit{"%", 1e-2}};
constexpr std::array kNumbers{Unit{"", 1.0}};

/// What a gate is measured on.
struct Case {
  const EvaluatedConfig& config;
  const RunSummary& summary;
  const RunSummary* baseline;  // of the same route
  std::size_t route;
};
using Value = std::optional<double>;

struct Metric {
  std::string_view name;
  std::span<const Unit> units;
  bool at_least;   // is better when larger
  bool of_config;  // the same on every route
  std::string_view meaning;
  Value (*value)(const Case&);
};

Value number(double x) { return x; }
Value mean(const Statistics& s) { return s.count > 0 ? number(s.mean) : Value{}; }
Value p95(const Statistics& s) { return s.count > 0 ? number(s.p95) : Value{}; }
Value most(const Statistics& s) { return s.count > 0 ? number(s.max) : Value{}; }

/// How far the mean error is above that of another run; none if one of the two has none.
Value excess(const Case& c, const RunSummary* other) {
  if (other == nullptr || c.summary.error_m.count == 0 || other->error_m.count == 0) return {};
  return c.summary.error_m.mean - other->error_m.mean;
}

Value over_opponents(const Case& c) {
  Value worst;
  for (const Opponent& opponent : c.config.opponents) {
    const Value over = excess(c, &opponent.routes[c.route].summary);
    if (over && (!worst || *over > *worst)) worst = over;
  }
  return worst;
}

constexpr std::array kMetrics{
    Metric{"error", kLengths, false, false, "mean distance from the reference, tracked scans",
           [](const Case& c) { return mean(c.summary.error_m); }},
    Metric{"error_p95", kLengths, false, false, "95th percentile of that distance",
           [](const Case& c) { return p95(c.summary.error_m); }},
    Metric{"error_max", kLengths, false, false, "largest such distance",
           [](const Case& c) { return most(c.summary.error_m); }},
    Metric{"excess", kLengths, false, false, "mean error minus that of the baseline (--baseline)",
           [](const Case& c) { return excess(c, c.baseline); }},
    Metric{"over_opponents", kLengths, false, false,
           "mean error minus that of the best opponent of equal size", over_opponents},
    Metric{"rotation", kAngles, false, false, "mean angle from the reference, tracked scans",
           [](const Case& c) { return mean(c.summary.error_deg); }},
    Metric{"rotation_p95", kAngles, false, false, "95th percentile of that angle",
           [](const Case& c) { return p95(c.summary.error_deg); }},
    Metric{"rotation_max", kAngles, false, false, "largest such angle",
           [](const Case& c) { return most(c.summary.error_deg); }},
    Metric{"relative", kLengths, false, false, "mean error of the motion to the next scan",
           [](const Case& c) { return mean(c.summary.relative_frame.m); }},
    Metric{"relative_10m", kLengths, false, false, "mean error of the motion over 10 m",
           [](const Case& c) { return mean(c.summary.relative_10m.m); }},
    Metric{"lost", kNumbers, false, false, "scans that are not tracked",
           [](const Case& c) { return number(static_cast<double>(c.summary.lost)); }},
    Metric{"lost", kPercents, false, false, "share of the scans that are not tracked",
           [](const Case& c) {
             return number(static_cast<double>(c.summary.lost) /
                           static_cast<double>(std::max<std::size_t>(c.summary.scans, 1)));
           }},
    Metric{"wrong", kNumbers, false, false, "tracked scans more than 2 m or 5 degrees off",
           [](const Case& c) -> Value {
             if (c.summary.error_m.count == 0) return {};
             return static_cast<double>(c.summary.tracked_far_off);
           }},
    Metric{"blocking", kNumbers, false, false, "switches to a map that was not ready",
           [](const Case& c) { return number(static_cast<double>(c.summary.blocking_loads)); }},
    Metric{"stall", kTimes, false, false, "longest wait for a map",
           [](const Case& c) { return most(c.summary.stall_ms); }},
    Metric{"T_align", kTimes, false, false, "mean time of scan matching",
           [](const Case& c) { return mean(c.summary.align_ms); }},
    Metric{"T_align_p95", kTimes, false, false, "95th percentile of that time",
           [](const Case& c) { return p95(c.summary.align_ms); }},
    Metric{"coverage", kShares, true, false, "mean share of scan points with a voxel",
           [](const Case& c) { return mean(c.summary.coverage); }},
    Metric{"NVTL", kNumbers, true, false, "mean nearest voxel transformation likelihood",
           [](const Case& c) { return mean(c.summary.nvtl); }},
    Metric{"fitness", kNumbers, true, false, "mean S_fitness (Eq. 12)",
           [](const Case& c) { return mean(c.summary.fitness); }},
    Metric{"memory", kBytes, false, false, "most that ready maps take at once",
           [](const Case& c) { return number(static_cast<double>(c.summary.held_bytes)); }},
    Metric{"points", kNumbers, false, true, "mean number of points of a region map",
           [](const Case& c) { return mean(c.config.region_points); }},
    Metric{"reduction", kShares, true, true,
           "share of the wide-area map's points that the mean region map does without",
           [](const Case& c) { return number(c.config.reduction()); }},
    Metric{"bytes", kBytes, false, true, "size of the bundle",
           [](const Case& c) { return number(static_cast<double>(c.config.bundle_bytes)); }},
};

const Unit* find_unit(const Metric& metric, std::string_view name) {
  const auto unit = std::find_if(metric.units.begin(), metric.units.end(),
                                 [&](const Unit& u) { return u.name == name; });
  return unit == metric.units.end() ? nullptr : &*unit;
}

struct Measure {
  const Metric* metric;
  const Unit* unit;
};
/// None if no metric of that name has the unit.
std::optional<Measure> find_measure(std::string_view name, std::string_view unit) {
  for (const Metric& metric : kMetrics) {
    if (metric.name != name) continue;
    if (const Unit* found = find_unit(metric, unit)) return Measure{&metric, found};
  }
  return {};
}

std::string units_of(std::string_view name) {
  std::vector<std::string> units;
  for (const Metric& metric : kMetrics) {
    if (metric.name != name) continue;
    for (const Unit& unit : metric.units) {
      units.emplace_back(unit.name.empty() ? "a plain number" : unit.name);
    }
  }
  return fmt::format("{}", fmt::join(units, ", "));
}

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const Metric& metric : kMetrics) {
    if (all.empty() || all.back() != metric.name) all.emplace_back(metric.name);
  }
  return all;
}

tl::unexpected<Error> bad_gate(std::string_view text, const std::string& why) {
  return fail(ErrorCode::invalid_input, fmt::format("gate '{}': {}", text, why));
}

Result<Gate> parse_gate(std::string_view text) {
  const std::size_t sign = text.find('=');
  if (sign == std::string_view::npos || sign == 0) {
    return bad_gate(text, "expected a metric and its limit, such as error=0.5cm");
  }
  Gate gate;
  gate.text = text;
  const char before = text[sign - 1];
  const bool signed_limit = before == '<' || before == '>';
  gate.metric = text.substr(0, signed_limit ? sign - 1 : sign);
  const std::vector<std::string> known = names();
  if (std::find(known.begin(), known.end(), gate.metric) == known.end()) {
    return bad_gate(text, fmt::format("there is no metric '{}'{}; there are {}", gate.metric,
                                      did_you_mean(gate.metric, known), fmt::join(known, ", ")));
  }
  const std::string_view value = text.substr(sign + 1);
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), gate.limit);
  if (error != std::errc{} || !std::isfinite(gate.limit)) {
    return bad_gate(text, fmt::format("expected a number after '=', not '{}'", value));
  }
  gate.unit = value.substr(static_cast<std::size_t>(end - value.data()));
  const auto measure = find_measure(gate.metric, gate.unit);
  if (!measure) {
    return bad_gate(text, fmt::format("{} '{}' is none of {}: {}",
                                      gate.unit.empty() ? "the empty unit" : "the unit", gate.unit,
                                      gate.metric, units_of(gate.metric)));
  }
  gate.at_least = signed_limit ? before == '>' : measure->metric->at_least;
  return gate;
}

GateResult judge(const Gate& gate, const Measure& measure, const Case& c, std::string route) {
  GateResult result{.gate = gate, .route = std::move(route)};
  if (const Value value = measure.metric->value(c)) {
    result.value = *value / measure.unit->size;
    result.holds = gate.at_least ? *result.value >= gate.limit : *result.value <= gate.limit;
  }
  return result;
}

std::string with_unit(const std::string& number, const std::string& unit) {
  return unit.empty() ? number : number + ' ' + unit;
}

}  // namespace

Result<std::vector<Gate>> parse_gates(std::string_view text) {
  std::vector<Gate> gates;
  std::string config;
  if (const std::size_t colon = text.find(':'); colon < text.find('=')) {
    config = text.substr(0, colon);
    text.remove_prefix(colon + 1);
  }
  while (true) {
    const std::size_t comma = text.find(',');
    VANTAGE_TRY(Gate gate, parse_gate(text.substr(0, comma)));
    gate.config = config;
    gates.push_back(std::move(gate));
    if (comma == std::string_view::npos) return gates;
    text.remove_prefix(comma + 1);
  }
}

std::string gate_help() {
  std::string help;
  for (const Metric& metric : kMetrics) {
    std::vector<std::string_view> units;
    for (const Unit& unit : metric.units) {
      if (!unit.name.empty()) units.push_back(unit.name);
    }
    help += fmt::format("  {:<15}{}  {:<12}{}\n", metric.name,
                        metric.at_least ? ">=" : "<=", fmt::format("{}", fmt::join(units, " ")),
                        metric.meaning);
  }
  return help;
}

std::vector<GateResult> judge(const std::vector<Gate>& gates, const EvaluatedConfig& config,
                              const std::vector<std::string>& routes,
                              const EvaluatedConfig* baseline) {
  std::vector<GateResult> results;
  for (const Gate& gate : gates) {
    if (!gate.config.empty() && gate.config != config.name) continue;
    const auto measure = find_measure(gate.metric, gate.unit);
    if (!measure) continue;  // parse_gates never makes such a gate
    for (std::size_t r = 0; r < routes.size(); ++r) {
      const Case c{.config = config,
                   .summary = config.routes[r].summary,
                   .baseline = baseline ? &baseline->routes[r].summary : nullptr,
                   .route = r};
      if (measure->metric->of_config) {
        results.push_back(judge(gate, *measure, c, ""));
        break;
      }
      results.push_back(judge(gate, *measure, c, routes[r]));
    }
  }
  return results;
}

std::string value_text(const GateResult& result) {
  return result.value ? with_unit(fmt::format("{:.4g}", *result.value), result.gate.unit)
                      : "not measured";
}

std::string to_string(const GateResult& result) {
  const Gate& gate = result.gate;
  return fmt::format(
      "{} {} {} {}{}{}", gate.metric, value_text(result),
      gate.at_least ? ">=" : "<=", with_unit(fmt::format("{}", gate.limit), gate.unit),
      result.route.empty() ? "" : " on ", result.route);
}

}  // namespace vantage
