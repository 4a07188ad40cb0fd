#include "evaluate/page/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "terminal/table.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage::page {
namespace {

using report::Cell;
using report::Table;
using report::TableRow;

using Number = std::optional<double>;

/// A statistic of a run: a column of a table.
struct Column {
  std::string path;                                                       ///< in summary.json
  std::string head;                                                       ///< with the unit
  const Metric* metric;                                                   ///< says how it is shown
  Number (*relative)(const RunSummary&, double Statistics::*) = nullptr;  ///< else of the metric
  NamedStatistic statistic;

  [[nodiscard]] Number value(const RunSummary& summary) const {
    if (relative != nullptr) return relative(summary, statistic.member);
    const Statistics s = summary[metric->key];
    return s.count == 0 ? Number{} : Number{s.*statistic.member};
  }
};

struct ColumnGroup {
  std::string head;
  std::vector<Column> columns;
};

struct Block {
  const char* caption;
  std::vector<ColumnGroup> groups;
};

Column column_of(const Metric& metric, const NamedStatistic& statistic, std::string head) {
  return {.path = metric.is_count() ? fmt::format("scans.{}", metric.key)
                                    : fmt::format("{}.{}", metric.key, statistic.name),
          .head = std::move(head),
          .metric = &metric,
          .statistic = statistic};
}

/// A head for each metric, its statistics beneath.
Block error_block() {
  Block block{"Absolute error, without aligning the trajectories", {}};
  for (const Metric* metric : metrics_by_group()) {
    if (metric->group != MetricGroup::error) continue;
    ColumnGroup& group = block.groups.emplace_back(ColumnGroup{heading(*metric), {}});
    for (const NamedStatistic& statistic : statistics_in(metric->statistics)) {
      group.columns.push_back(column_of(*metric, statistic, std::string(statistic.name)));
    }
  }
  return block;
}

template <RelativeErrors RunSummary::*step, Statistics RelativeErrors::*part>
Number relative(const RunSummary& summary, double Statistics::*statistic) {
  const Statistics& s = summary.*step.*part;
  return s.count == 0 ? Number{} : Number{s.*statistic};
}

template <RelativeErrors RunSummary::*step>
ColumnGroup relative_group(const char* head, const char* path) {
  ColumnGroup group{head, {}};
  const auto add = [&](const char* key, const char* part, auto value) {
    const Metric* metric = find_metric(key);
    for (const NamedStatistic& statistic : statistics_in("mean p95")) {
      group.columns.push_back({fmt::format("relative_error.{}.{}.{}", path, part, statistic.name),
                               fmt::format("{} [{}]", statistic.name, metric->unit->shown), metric,
                               value, statistic});
    }
  };
  add("error_m", "m", &relative<step, &RelativeErrors::m>);
  add("error_deg", "deg", &relative<step, &RelativeErrors::deg>);
  return group;
}

/// The metrics of some groups, a head for each group.
Block block_of(const char* caption,
               const std::vector<std::pair<MetricGroup, const char*>>& groups) {
  Block block{caption, {}};
  for (const auto& [group, head] : groups) {
    ColumnGroup& columns = block.groups.emplace_back(ColumnGroup{head, {}});
    for (const Metric* metric : metrics_by_group()) {
      if (metric->group != group) continue;
      const auto statistics = statistics_in(metric->statistics);
      for (const NamedStatistic& statistic : statistics) {
        columns.columns.push_back(column_of(
            *metric, statistic,
            statistics.size() == 1 ? heading(*metric)
                                   : fmt::format("{}, {}", heading(*metric), statistic.name)));
      }
    }
  }
  return block;
}

std::vector<Block> blocks() {
  return {error_block(),
          {"Relative error",
           {relative_group<&RunSummary::relative_frame>("to the next scan", "next_scan"),
            relative_group<&RunSummary::relative_10m>("over 10 m", "10m")}},
          block_of("Maps in use and scans",
                   {{MetricGroup::map, "maps in use"}, {MetricGroup::scans, "scans"}}),
          block_of("Time", {{MetricGroup::time, "of a scan"}}),
          block_of("Match", {{MetricGroup::match, "mean over scans"}})};
}

std::string shown(const Column& column, double value, const RunSummary& summary) {
  const Metric& m = *column.metric;
  if (!m.counted_of.empty())
    return cli::grouped_whole(value) + " of " + cli::grouped(summary[m.key].count);
  return vantage::shown(m, value);
}

Number value_of(const Column& c, const MapRun& r) {
  return c.metric->is(kOwnMaps) && !r.own() ? Number{} : c.value(r.run->summary);
}

Cell cell_of(const Column& c, const MapRun& r, const Evaluation& e) {
  const RunSummary& summary = r.run->summary;
  const Number value = value_of(c, r);
  if (!value) return {"–"};
  return {shown(c, *value, summary),
          {{"config", r.config->name},
           {"route", e.routes[r.route].name},
           {"map", std::string(r.map)},
           {"metric", c.path},
           {"value", fmt::format("{}", *value)}}};
}

/// The best shown value of a column; none where most are alike or nothing is better.
std::optional<std::string> best_of(const Column& c, const std::vector<MapRun>& runs) {
  const Better better = c.metric->better;
  if (better == Better::neither) return {};
  const double sign = better == Better::less ? 1.0 : -1.0;
  std::vector<std::string> texts;
  std::string best;
  double least = std::numeric_limits<double>::infinity();
  for (const MapRun& r : runs) {
    const Number value = value_of(c, r);
    if (!value) continue;
    texts.push_back(shown(c, *value, r.run->summary));
    if (sign * *value >= least) continue;
    least = sign * *value;
    best = texts.back();
  }
  const auto alike = std::count(texts.begin(), texts.end(), best);
  return 2 * static_cast<std::size_t>(alike) <= texts.size() ? std::optional(best) : std::nullopt;
}

void add_route(Table& table, const Block& block, const Evaluation& e, std::size_t route) {
  const std::vector<MapRun> runs = runs_of(e, route);
  if (e.routes.size() > 1) {
    table.rows.push_back({.cells = {{e.routes[route].name}}, .heading = true});
  }
  const std::size_t first = table.rows.size();
  for (const MapRun& r : runs) {
    table.rows.push_back(
        {.cells = {{r.own() ? r.config->name : std::string(r.map)}}, .beneath = !r.own()});
  }
  for (const ColumnGroup& group : block.groups) {
    for (const Column& column : group.columns) {
      const auto best = best_of(column, runs);
      for (std::size_t i = 0; i < runs.size(); ++i) {
        Cell cell = cell_of(column, runs[i], e);
        cell.best = best && cell.text == *best;
        table.rows[first + i].cells.push_back(std::move(cell));
      }
    }
  }
}

Table table_of(const Block& block, const Evaluation& e) {
  Table table{.caption = block.caption, .groups = {{"", 1}}, .header = {"configuration"}};
  for (const ColumnGroup& group : block.groups) {
    table.groups.push_back({group.head, group.columns.size()});
    for (const Column& column : group.columns) table.header.push_back(column.head);
  }
  for (std::size_t route = 0; route < e.routes.size(); ++route) add_route(table, block, e, route);
  return table;
}

/// A number of a configuration that does not depend on the route.
Cell config_cell(const EvaluatedConfig& c, const char* metric, double value, std::string text) {
  return {std::move(text),
          {{"config", c.name}, {"metric", metric}, {"value", fmt::format("{}", value)}}};
}

std::string gate_table(const Evaluation& e) {
  Table table{.caption = "Gates",
              .header = {"configuration", "route", "gate", "value", "verdict"},
              .name_columns = 3};
  for (const EvaluatedConfig& c : e.configs) {
    for (const GateResult& g : c.gates) {
      Cell value{value_text(g), {{"config", c.name}, {"route", g.route}, {"gate", g.gate.text}}};
      if (g.value) value.data.emplace_back("value", fmt::format("{}", *g.value));
      table.rows.push_back(
          {.cells = {{c.name},
                     {g.route.empty() ? "all" : g.route},
                     {g.gate.text},
                     std::move(value),
                     {g.holds ? "holds" : "fails", {{"verdict", g.holds ? "holds" : "fails"}}}}});
    }
  }
  return to_html(table);
}

/// Mean over routes, each scan counting the same.
Number mean_of(std::string_view metric, const std::vector<RouteRun>& routes) {
  double sum = 0.0;
  std::size_t n = 0;
  for (const RouteRun& r : routes) {
    const Statistics s = r.summary[metric];
    sum += s.mean * static_cast<double>(s.count);
    n += s.count;
  }
  return n == 0 ? Number{} : Number{sum / static_cast<double>(n)};
}

/// What a metric counts on all routes.
std::size_t count_of(std::string_view metric, const std::vector<RouteRun>& routes) {
  std::size_t sum = 0;
  for (const RouteRun& r : routes) sum += r.summary.count(metric);
  return sum;
}

/// "; 3 of 200 scans lost, 5 uncertain, 1 misleading."
std::string states_of(const std::vector<RouteRun>& routes) {
  std::size_t scans = 0;
  for (const RouteRun& r : routes) scans += r.summary.scans;
  const std::size_t lost = count_of("lost", routes);
  std::string text =
      lost == 0 ? fmt::format("; none of {} lost", cli::counted(scans, "scan"))
                : fmt::format("; {} of {} lost", cli::grouped(lost), cli::counted(scans, "scan"));
  if (const auto n = count_of("uncertain", routes); n > 0)
    text += ", " + cli::grouped(n) + " uncertain";
  if (const auto n = count_of("misleading", routes); n > 0) {
    text += ", " + cli::grouped(n) + " misleading";
  }
  return text + ".";
}

/// " with 3 lost, 5 uncertain", where a baseline differs from its configuration.
std::string states_beside(const std::vector<RouteRun>& baseline, const std::vector<RouteRun>& own) {
  std::size_t scans = 0;
  for (const RouteRun& r : own) scans += r.summary.scans;
  if (count_of("lost", baseline) == scans) return " lost throughout";
  std::string text;
  for (const char* state : {"lost", "uncertain"}) {
    const std::size_t n = count_of(state, baseline);
    if (n == count_of(state, own)) continue;
    text += text.empty() ? " with " : ", ";
    text += n == 0 ? fmt::format("none {}", state) : fmt::format("{} {}", cli::grouped(n), state);
  }
  return text;
}

std::string sentence(const Evaluation& e, const EvaluatedConfig& c) {
  const EvaluatedConfig* wide = wide_area_config(e);
  const Number error = mean_of("error_m", c.routes);
  std::string text = fmt::format("<strong>{}</strong>: ", report::escaped(c.name));
  if (&c == wide) {
    text += "the wide-area map";
  } else if (const Number used = mean_of("reduction_used", c.routes)) {
    text += fmt::format("the maps that scans used leave out {:.1f} % of the wide-area map’s points",
                        100.0 * *used);
  } else if (c.region_points.count == 0) {
    text += fmt::format("{} without points, ready to match against",
                        cli::counted(c.index.partition.size(), "region map"));
  } else {
    text += "no scan was matched";
  }
  if (error) text += fmt::format("; mean error {:.2f} cm", 100.0 * *error);
  const Number wide_error = wide != nullptr ? mean_of("error_m", wide->routes) : Number{};
  if (error && wide_error && &c != wide && *wide_error > 0.0) {
    text += fmt::format(", {:.2f} times the wide-area map’s", *error / *wide_error);
  }
  text += states_of(c.routes);
  std::string baselines;
  for (const Baseline& baseline : c.baselines) {
    const Number theirs = mean_of("error_m", baseline.routes);
    baselines += (baselines.empty() ? "" : ", ") + report::escaped(baseline.name);
    if (theirs) baselines += fmt::format(" {:.2f} cm", 100.0 * *theirs);
    baselines += states_beside(baseline.routes, c.routes);
  }
  if (!baselines.empty())
    text += " The same number of points, chosen otherwise: " + baselines + ".";
  return text;
}

}  // namespace

std::vector<MapRun> runs_of(const Evaluation& e, std::size_t route) {
  std::vector<MapRun> runs;
  for (std::size_t c = 0; c < e.configs.size(); ++c) {
    const EvaluatedConfig& config = e.configs[c];
    if (route < config.routes.size()) {
      runs.push_back({&config, c, kOwnMap, route, &config.routes[route]});
    }
    for (const Baseline& baseline : config.baselines) {
      if (route >= baseline.routes.size()) continue;
      runs.push_back({&config, c, baseline.name, route, &baseline.routes[route]});
    }
  }
  return runs;
}

std::string verdict(const Evaluation& e) {
  std::string html;
  const bool gated = std::any_of(e.configs.begin(), e.configs.end(),
                                 [](const EvaluatedConfig& c) { return !c.gates.empty(); });
  html += "<ul class=\"verdicts\">\n";
  for (const EvaluatedConfig& c : e.configs) {
    html += "<li>";
    if (const auto passed = c.passed()) {
      html += report::badge(*passed, *passed ? "holds" : "fails") + " ";
    }
    html += sentence(e, c) + "</li>\n";
  }
  html += "</ul>\n";
  if (gated) html += gate_table(e);
  return html;
}

std::string points_table(const Evaluation& e) {
  Table table{.caption = "Table 1. Comparison of point counts, all regions",
              .groups = {{"", 2}, {"points of a region map", 4}, {"", 3}},
              .header = {"configuration", "regions", "min", "mean", "max", "std",
                         "share of the map", "reduction", "on disk [MB]"}};
  for (const EvaluatedConfig& c : e.configs) {
    const auto& p = c.region_points;
    const auto regions = static_cast<double>(c.index.partition.size());
    const auto megabytes = static_cast<double>(c.bundle_bytes) / 1e6;
    TableRow row{
        .cells = {{c.name}, config_cell(c, "regions", regions, cli::grouped_whole(regions))}};
    const auto points = [&](const char* name, double value) {
      row.cells.push_back(p.count > 0 ? config_cell(c, name, value, cli::grouped_whole(value))
                                      : Cell{"–"});
    };
    points("points_per_region.min", p.min);
    points("points_per_region.mean", p.mean);
    points("points_per_region.max", p.max);
    points("points_per_region.std", p.std);
    const Number reduction = c.reduction();
    row.cells.push_back(reduction ? Cell{fmt::format("{:.2f} %", 100.0 * (1.0 - *reduction))}
                                  : Cell{"–"});
    row.cells.push_back(reduction ? config_cell(c, "reduction", *reduction,
                                                fmt::format("{:.2f} %", 100.0 * *reduction))
                                  : Cell{"–"});
    row.cells.push_back(config_cell(c, "bytes", static_cast<double>(c.bundle_bytes),
                                    fmt::format("{:.2f}", megabytes)));
    table.rows.push_back(std::move(row));
  }
  const std::uint64_t map_points = e.configs.empty() ? 0 : e.configs.front().index.map_points;
  return fmt::format(
             "<p>The wide-area map has <strong data-metric=\"map.points\" "
             "data-value=\"{}\">{}</strong> points. Region maps overlap: what can be seen from a "
             "region reaches beyond it, so all of them together may take more room than the "
             "map.</p>\n",
             map_points, cli::grouped(map_points)) +
         to_html(table);
}

std::string accuracy_tables(const Evaluation& e) {
  std::string html =
      "<p>Errors and scores are over tracked scans. Below each configuration are its baselines: "
      "region maps with equal numbers of points, chosen without regard to visibility. The best "
      "value of a column is green and bold. The maps of baselines are made during the drive, so "
      "their stalls would be meaningless.</p>\n";
  for (const Block& block : blocks()) html += to_html(table_of(block, e));
  std::string none;
  for (const EvaluatedConfig& c : e.configs) {
    if (c.no_baselines.empty()) continue;
    none +=
        fmt::format("<li>{}: {}</li>\n", report::escaped(c.name), report::escaped(c.no_baselines));
  }
  if (!none.empty()) html += "<p>Without baselines:</p><ul>\n" + none + "</ul>\n";
  return html;
}

}  // namespace vantage::page
