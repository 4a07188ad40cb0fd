#include "vantage/evaluation/gates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <span>

#include "vantage/config_value.hpp"
#include "vantage/evaluation/evaluation.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage {
namespace {

using Size = MetricUnit::Size;
constexpr std::array kLengths{Size{"m", 1.0}, Size{"cm", 1e-2}, Size{"mm", 1e-3}};
constexpr std::array kBytes{Size{"MB", 1e6}, Size{"kB", 1e3}, Size{"GB", 1e9}, Size{"B", 1.0}};
constexpr std::array kShares{Size{"%", 1e-2}, Size{"", 1.0}};
constexpr std::array kPercents{Size{"%", 1e-2}};
constexpr std::array kNumbers{Size{"", 1.0}};

/// What a gate is measured on.
struct Case {
  const EvaluatedConfig& config;
  const RunSummary& summary;
  const RunSummary* excess_over;  // of the same route
  std::size_t route;
};
using Value = std::optional<double>;

/// What a gate can limit.
struct Measure {
  std::string name;
  std::span<const Size> units;
  bool at_least;      // is better when larger
  bool of_config;     // the same on every route
  bool needs_points;  // not known of a bundle that stores none
  bool in_help;
  std::string meaning;
  std::function<Value(const Case&)> value;
};

Value number(double x) { return x; }
Value mean(const Statistics& s) { return s.count > 0 ? number(s.mean) : Value{}; }

/// How far the mean error is above that of another run; none if one of the two has none.
Value excess(const Case& c, const RunSummary* other) {
  if (other == nullptr) return {};
  const Value own = mean(c.summary["error_m"]), theirs = mean((*other)["error_m"]);
  return own && theirs ? number(*own - *theirs) : Value{};
}

Value over_baselines(const Case& c) {
  Value worst;
  for (const Baseline& baseline : c.config.baselines) {
    const Value over = excess(c, &baseline.routes[c.route].summary);
    if (over && (!worst || *over > *worst)) worst = over;
  }
  return worst;
}

Measure measure_of(const Metric& metric, const NamedStatistic& statistic, bool headline) {
  const std::string_view name = name_in_gates(metric);
  return {.name = headline ? std::string(name) : fmt::format("{}_{}", name, statistic.name),
          .units = metric.unit->limits,
          .at_least = metric.better == Better::more,
          .of_config = false,
          .needs_points = metric.is(kNeedsPoints),
          .in_help = headline,
          .meaning = fmt::format("{}: {}", statistic.name, metric.doc),
          .value = [key = metric.key, member = statistic.member](const Case& c) {
            const Statistics s = c.summary[key];
            return s.count > 0 ? number(s.*member) : Value{};
          }};
}

Measure share_of(const Metric& metric) {
  return {.name = std::string(metric.key),
          .units = kPercents,
          .at_least = false,
          .of_config = false,
          .needs_points = false,
          .in_help = true,
          .meaning = fmt::format("share of the {}: {}", metric.counted_of, metric.doc),
          .value = [key = metric.key](const Case& c) {
            const Statistics s = c.summary[key];
            return s.count > 0 ? number(s.sum / static_cast<double>(s.count)) : Value{};
          }};
}

void add_measures_of(const Metric& metric, std::vector<Measure>& all) {
  all.push_back(measure_of(metric, headline(metric), true));
  if (!metric.counted_of.empty()) all.push_back(share_of(metric));
  if (metric.is_count()) return;
  for (const NamedStatistic& statistic : named_statistics()) {
    all.push_back(measure_of(metric, statistic, false));
  }
}

/// Everything that can be limited: each metric of scans, and what only a run or its maps have.
std::vector<Measure> measures() {
  std::vector<Measure> all;
  for (const Metric* metric : metrics_by_group()) add_measures_of(*metric, all);
  const auto add = [&](const char* name, std::span<const Size> units, const char* meaning,
                       Value (*value)(const Case&)) -> Measure& {
    return all.emplace_back(Measure{.name = name,
                                    .units = units,
                                    .at_least = false,
                                    .of_config = false,
                                    .needs_points = false,
                                    .in_help = true,
                                    .meaning = meaning,
                                    .value = value});
  };
  add("excess", kLengths, "mean error minus that of the configuration --excess-over",
      [](const Case& c) { return excess(c, c.excess_over); });
  add("over_baselines", kLengths, "mean error minus that of the best baseline of equal size",
      over_baselines);
  add("relative", kLengths, "mean error of the motion to the next scan",
      [](const Case& c) { return mean(c.summary.relative_frame.m); });
  add("relative_10m", kLengths, "mean error of the motion over 10 m",
      [](const Case& c) { return mean(c.summary.relative_10m.m); });
  Measure& points = add("points", kNumbers, "mean number of points of a region map, all regions",
                        [](const Case& c) { return mean(c.config.region_points); });
  points.of_config = points.needs_points = true;
  Measure& reduction =
      add("reduction", kShares,
          "share of the wide-area map's points that the mean region map leaves out, all regions",
          [](const Case& c) { return c.config.reduction(); });
  reduction.of_config = reduction.needs_points = reduction.at_least = true;
  add("bytes", kBytes, "size of the bundle", [](const Case& c) {
    return number(static_cast<double>(c.config.bundle_bytes));
  }).of_config = true;
  return all;
}

/// Names that gates had before.
struct Alias {
  std::string_view old, now;
};
constexpr std::array kAliases{
    Alias{"T_align", "align"},    Alias{"rotation", "error"},
    Alias{"NVTL", "nvtl"},        Alias{"memory", "held"},
    Alias{"blocking", "blocked"}, Alias{"over_opponents", "over_baselines"}};

/// "align_p95" for "T_align_p95".
std::string name_now(std::string_view name) {
  for (const Alias& alias : kAliases) {
    if (!name.starts_with(alias.old)) continue;
    const std::string_view rest = name.substr(alias.old.size());
    if (rest.empty() || rest.front() == '_') return std::string(alias.now) + std::string(rest);
  }
  return std::string(name);
}

const Size* find_unit(const Measure& measure, std::string_view name) {
  const auto unit = std::find_if(measure.units.begin(), measure.units.end(),
                                 [&](const Size& u) { return u.name == name; });
  return unit == measure.units.end() ? nullptr : &*unit;
}

/// nullptr if no measure of that name has the unit.
const Measure* find_measure(const std::vector<Measure>& all, std::string_view name,
                            std::string_view unit) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Measure& measure) {
    return measure.name == name && find_unit(measure, unit) != nullptr;
  });
  return found == all.end() ? nullptr : &*found;
}

std::string units_of(const std::vector<Measure>& all, std::string_view name) {
  std::vector<std::string> units;
  for (const Measure& measure : all) {
    if (measure.name != name) continue;
    for (const Size& unit : measure.units) {
      units.emplace_back(unit.name.empty() ? "a plain number" : unit.name);
    }
  }
  return fmt::format("{}", fmt::join(units, ", "));
}

/// @param all  also those that the help does not list
std::vector<std::string> names_of(const std::vector<Measure>& measures, bool all) {
  std::vector<std::string> names;
  for (const Measure& measure : measures) {
    const bool known = std::find(names.begin(), names.end(), measure.name) != names.end();
    if ((all || measure.in_help) && !known) names.push_back(measure.name);
  }
  return names;
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
  gate.metric = name_now(gate.metric);
  const std::vector<Measure> all = measures();
  const std::vector<std::string> known = names_of(all, true);
  if (std::find(known.begin(), known.end(), gate.metric) == known.end()) {
    return bad_gate(
        text, fmt::format("there is no metric '{}'{}; there are {}", gate.metric,
                          did_you_mean(gate.metric, known), fmt::join(names_of(all, false), ", ")));
  }
  const std::string_view value = text.substr(sign + 1);
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), gate.limit);
  if (error != std::errc{} || !std::isfinite(gate.limit)) {
    return bad_gate(text, fmt::format("expected a number after '=', not '{}'", value));
  }
  gate.unit = value.substr(static_cast<std::size_t>(end - value.data()));
  const Measure* measure = find_measure(all, gate.metric, gate.unit);
  if (measure == nullptr) {
    const std::string units = units_of(all, gate.metric);
    return bad_gate(text, gate.unit.empty() ? fmt::format("{} needs a unit: {}", gate.metric, units)
                                            : fmt::format("{} has no unit '{}'; expected {}",
                                                          gate.metric, gate.unit, units));
  }
  gate.at_least = signed_limit ? before == '>' : measure->at_least;
  return gate;
}

GateResult judge(const Gate& gate, const Measure& measure, const Case& c, std::string route) {
  GateResult result{.gate = gate, .route = std::move(route)};
  if (const Value value = measure.value(c)) {
    result.value = *value / find_unit(measure, gate.unit)->size;
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
  for (const Measure& measure : measures()) {
    if (!measure.in_help) continue;
    std::vector<std::string_view> units;
    for (const Size& unit : measure.units) {
      if (!unit.name.empty()) units.push_back(unit.name);
    }
    help += fmt::format("  {:<15}{}  {:<12}{}\n", measure.name,
                        measure.at_least ? ">=" : "<=", fmt::format("{}", fmt::join(units, " ")),
                        measure.meaning);
  }
  return help +
         "  _mean, _rmse, _std, _min, _median, _p95, _p99 or _max after a name selects that "
         "statistic: error_p95=1cm\n";
}

Result<void> check_measurable(const std::vector<Gate>& gates, const std::string& config,
                              const MapIndex& index) {
  if (stores_points(index)) return {};
  const std::vector<Measure> all = measures();
  for (const Gate& gate : gates) {
    if (!gate.config.empty() && gate.config != config) continue;
    const Measure* measure = find_measure(all, gate.metric, gate.unit);
    if (measure == nullptr || !measure->needs_points) continue;
    return bad_gate(gate.text,
                    fmt::format("the bundle of '{}' stores no points, so its {} is not known",
                                config, gate.metric));
  }
  return {};
}

std::vector<GateResult> judge(const std::vector<Gate>& gates, const EvaluatedConfig& config,
                              const std::vector<std::string>& routes,
                              const EvaluatedConfig* excess_over) {
  std::vector<GateResult> results;
  const std::vector<Measure> all = measures();
  for (const Gate& gate : gates) {
    if (!gate.config.empty() && gate.config != config.name) continue;
    const Measure* measure = find_measure(all, gate.metric, gate.unit);
    if (measure == nullptr) continue;  // parse_gates makes no such gate
    for (std::size_t r = 0; r < routes.size(); ++r) {
      const Case c{.config = config,
                   .summary = config.routes[r].summary,
                   .excess_over = excess_over ? &excess_over->routes[r].summary : nullptr,
                   .route = r};
      if (measure->of_config) {
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
