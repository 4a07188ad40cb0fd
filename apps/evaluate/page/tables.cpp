#include "evaluate/page/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "terminal/table.hpp"

namespace vantage::page {
namespace {

using report::Cell;
using report::Table;
using report::TableRow;

enum class Better { neither, less, more };

/// A number of a RunSummary.
struct Metric {
  const char* name;  ///< its path in summary.json
  const char* head;  ///< with the unit
  int digits;
  double scale;  ///< of the unit shown
  Better better;
  std::optional<double> (*value)(const RunSummary&);
  bool of_scans = false;  ///< a count, shown as "3 of 77"
  bool own_maps = false;  ///< not measured for opponents, because their maps are made while driving
};

struct MetricGroup {
  const char* head;
  std::vector<Metric> metrics;
};

struct Block {
  const char* caption;
  std::vector<MetricGroup> groups;
};

using Number = std::optional<double>;
Number measured(const Statistics& s, double Statistics::*member) {
  return s.count == 0 ? Number{} : Number{s.*member};
}
Number count(std::size_t n) { return static_cast<double>(n); }

using S = Statistics;
using R = RunSummary;

std::vector<Block> blocks() {
  constexpr auto kLess = Better::less, kMore = Better::more;
  return {
      {"Absolute error, without aligning the trajectories",
       {{"position [cm]",
         {{"error_m.mean", "mean", 2, 100, kLess,
           [](const R& r) { return measured(r.error_m, &S::mean); }},
          {"error_m.rmse", "RMSE", 2, 100, kLess,
           [](const R& r) { return measured(r.error_m, &S::rmse); }},
          {"error_m.median", "median", 2, 100, kLess,
           [](const R& r) { return measured(r.error_m, &S::median); }},
          {"error_m.p95", "p95", 2, 100, kLess,
           [](const R& r) { return measured(r.error_m, &S::p95); }},
          {"error_m.max", "max", 2, 100, kLess,
           [](const R& r) { return measured(r.error_m, &S::max); }}}},
        {"rotation [°]",
         {{"error_deg.mean", "mean", 3, 1, kLess,
           [](const R& r) { return measured(r.error_deg, &S::mean); }},
          {"error_deg.rmse", "RMSE", 3, 1, kLess,
           [](const R& r) { return measured(r.error_deg, &S::rmse); }},
          {"error_deg.median", "median", 3, 1, kLess,
           [](const R& r) { return measured(r.error_deg, &S::median); }},
          {"error_deg.p95", "p95", 3, 1, kLess,
           [](const R& r) { return measured(r.error_deg, &S::p95); }},
          {"error_deg.max", "max", 3, 1, kLess,
           [](const R& r) { return measured(r.error_deg, &S::max); }}}}}},
      {"Relative error",
       {{"to the next scan",
         {{"relative_error.next_scan.m.mean", "mean [cm]", 2, 100, kLess,
           [](const R& r) { return measured(r.relative_frame.m, &S::mean); }},
          {"relative_error.next_scan.m.p95", "p95 [cm]", 2, 100, kLess,
           [](const R& r) { return measured(r.relative_frame.m, &S::p95); }},
          {"relative_error.next_scan.deg.mean", "mean [°]", 3, 1, kLess,
           [](const R& r) { return measured(r.relative_frame.deg, &S::mean); }},
          {"relative_error.next_scan.deg.p95", "p95 [°]", 3, 1, kLess,
           [](const R& r) { return measured(r.relative_frame.deg, &S::p95); }}}},
        {"over 10 m",
         {{"relative_error.10m.m.mean", "mean [cm]", 2, 100, kLess,
           [](const R& r) { return measured(r.relative_10m.m, &S::mean); }},
          {"relative_error.10m.m.p95", "p95 [cm]", 2, 100, kLess,
           [](const R& r) { return measured(r.relative_10m.m, &S::p95); }},
          {"relative_error.10m.deg.mean", "mean [°]", 3, 1, kLess,
           [](const R& r) { return measured(r.relative_10m.deg, &S::mean); }},
          {"relative_error.10m.deg.p95", "p95 [°]", 3, 1, kLess,
           [](const R& r) { return measured(r.relative_10m.deg, &S::p95); }}}}}},
      {"Scans and switches",
       {{"scans",
         {{"scans.lost", "lost", 0, 1, kLess, [](const R& r) { return count(r.lost); }, true},
          {"scans_beyond_2m_or_5deg", "beyond 2 m or 5°", 0, 1, kLess,
           [](const R& r) { return r.error_m.count == 0 ? Number{} : count(r.far_off); }, true}}},
        {"map switches",
         {{"scans.switches", "switches", 0, 1, Better::neither,
           [](const R& r) { return count(r.switches); }},
          {"scans.blocking_loads", "blocking loads", 0, 1, kLess,
           [](const R& r) { return count(r.blocking_loads); }, false, true},
          {"stall_ms.p99", "stall p99 [ms]", 2, 1, kLess,
           [](const R& r) { return measured(r.stall_ms, &S::p99); }, false, true},
          {"stall_ms.max", "stall max [ms]", 2, 1, kLess,
           [](const R& r) { return measured(r.stall_ms, &S::max); }, false, true}}}}},
      {"Match and cost",
       {{"the paper's",
         {{"T_align_ms.mean", "T_align mean [ms]", 2, 1, kLess,
           [](const R& r) { return measured(r.align_ms, &S::mean); }},
          {"T_align_ms.p95", "p95 [ms]", 2, 1, kLess,
           [](const R& r) { return measured(r.align_ms, &S::p95); }},
          {"fitness.mean", "S_fitness", 4, 1, kMore,
           [](const R& r) { return measured(r.fitness, &S::mean); }},
          {"LCP.mean", "LCP [10⁻⁶]", 3, 1e6, kMore,
           [](const R& r) { return measured(r.lcp, &S::mean); }}}},
        {"beside it",
         {{"coverage.mean", "coverage [%]", 1, 100, kMore,
           [](const R& r) { return measured(r.coverage, &S::mean); }},
          {"NVTL.mean", "NVTL", 3, 1, kMore, [](const R& r) { return measured(r.nvtl, &S::mean); }},
          {"N_point.mean", "map points", 0, 1, kLess,
           [](const R& r) { return measured(r.map_points, &S::mean); }},
          {"held_bytes_max", "memory [MB]", 2, 1e-6, kLess,
           [](const R& r) { return count(r.held_bytes); }}}}}}};
}

std::string shown(const Metric& m, double value, const RunSummary& summary) {
  if (m.of_scans) return fmt::format("{:.0f} of {}", value, summary.scans);
  if (m.digits == 0) return cli::grouped(static_cast<std::uint64_t>(std::llround(value * m.scale)));
  return fmt::format("{:.{}f}", value * m.scale, m.digits);
}

Number value_of(const Metric& m, const MapRun& r) {
  return m.own_maps && !r.own() ? Number{} : m.value(r.run->summary);
}

Cell cell_of(const Metric& m, const MapRun& r, const Evaluation& e) {
  const RunSummary& summary = r.run->summary;
  const Number value = value_of(m, r);
  if (!value) return {"–"};
  return {shown(m, *value, summary),
          {{"config", r.config->name},
           {"route", e.routes[r.route].name},
           {"map", std::string(r.map)},
           {"metric", m.name},
           {"value", fmt::format("{}", *value)}}};
}

/// The best value of a column as shown; none if most are alike or no value is better.
std::optional<std::string> best_of(const Metric& m, const std::vector<MapRun>& runs) {
  if (m.better == Better::neither) return {};
  const double sign = m.better == Better::less ? 1.0 : -1.0;
  std::vector<std::string> texts;
  std::string best;
  double least = std::numeric_limits<double>::infinity();
  for (const MapRun& r : runs) {
    const Number value = value_of(m, r);
    if (!value) continue;
    texts.push_back(shown(m, *value, r.run->summary));
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
  for (const MetricGroup& group : block.groups) {
    for (const Metric& m : group.metrics) {
      const auto best = best_of(m, runs);
      for (std::size_t i = 0; i < runs.size(); ++i) {
        Cell cell = cell_of(m, runs[i], e);
        cell.best = best && cell.text == *best;
        table.rows[first + i].cells.push_back(std::move(cell));
      }
    }
  }
}

Table table_of(const Block& block, const Evaluation& e) {
  Table table{.caption = block.caption, .groups = {{"", 1}}, .header = {"configuration"}};
  for (const MetricGroup& group : block.groups) {
    table.groups.push_back({group.head, group.metrics.size()});
    for (const Metric& m : group.metrics) table.header.emplace_back(m.head);
  }
  for (std::size_t route = 0; route < e.routes.size(); ++route) add_route(table, block, e, route);
  return table;
}

std::string whole(double x) { return cli::grouped(static_cast<std::uint64_t>(std::llround(x))); }

/// A number of a configuration that does not depend on the route.
Cell config_cell(const EvaluatedConfig& c, const char* metric, double value, std::string text) {
  return {std::move(text),
          {{"config", c.name}, {"metric", metric}, {"value", fmt::format("{}", value)}}};
}

bool has_points(const EvaluatedConfig& c) {
  return std::any_of(c.index.regions.begin(), c.index.regions.end(),
                     [](const RegionSummary& region) { return region.points > 0; });
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

/// Mean over routes, with equal weight for every scan.
Number mean_error(const std::vector<RouteRun>& routes) {
  double sum = 0.0;
  std::size_t n = 0;
  for (const RouteRun& r : routes) {
    sum += r.summary.error_m.mean * static_cast<double>(r.summary.error_m.count);
    n += r.summary.error_m.count;
  }
  return n == 0 ? Number{} : Number{sum / static_cast<double>(n)};
}

std::pair<std::size_t, std::size_t> lost_of(const std::vector<RouteRun>& routes) {
  std::size_t lost = 0, scans = 0;
  for (const RouteRun& r : routes) {
    lost += r.summary.lost;
    scans += r.summary.scans;
  }
  return {lost, scans};
}

std::string sentence(const Evaluation& e, const EvaluatedConfig& c) {
  const EvaluatedConfig* wide = wide_area_config(e);
  const Number error = mean_error(c.routes);
  const auto [lost, scans] = lost_of(c.routes);
  std::string text = fmt::format("<strong>{}</strong>: ", report::escaped(c.name));
  if (&c == wide) {
    text += "the wide-area map";
  } else if (has_points(c)) {
    text += fmt::format("the mean region map does without {:.1f} % of the wide-area map’s points",
                        100.0 * c.reduction());
  } else {
    text += fmt::format("{} region maps without points, ready to match against",
                        cli::grouped(c.index.partition.size()));
  }
  if (error) text += fmt::format("; mean error {:.2f} cm", 100.0 * *error);
  const Number wide_error = wide != nullptr ? mean_error(wide->routes) : Number{};
  if (error && wide_error && &c != wide && *wide_error > 0.0) {
    text += fmt::format(", {:.2f} times the wide-area map’s", *error / *wide_error);
  }
  text += lost == 0 ? fmt::format("; none of {} scans lost.", scans)
                    : fmt::format("; {} of {} scans lost.", lost, scans);
  std::string opponents;
  for (const Opponent& opponent : c.opponents) {
    const Number theirs = mean_error(opponent.routes);
    const std::size_t gone = lost_of(opponent.routes).first;
    opponents += (opponents.empty() ? "" : ", ") + report::escaped(opponent.name);
    if (theirs) opponents += fmt::format(" {:.2f} cm", 100.0 * *theirs);
    if (gone == scans) {
      opponents += " lost throughout";
    } else if (gone != lost) {
      opponents += gone == 0 ? " with none lost" : fmt::format(" with {} lost", gone);
    }
  }
  if (!opponents.empty()) text += " As many points chosen otherwise: " + opponents + ".";
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
    for (const Opponent& opponent : config.opponents) {
      if (route >= opponent.routes.size()) continue;
      runs.push_back({&config, c, opponent.name, route, &opponent.routes[route]});
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
  Table table{.caption = "Table 1. Comparison of point counts",
              .groups = {{"", 2}, {"points of a region map", 4}, {"", 3}},
              .header = {"configuration", "regions", "min", "mean", "max", "std",
                         "share of the map", "reduction", "on disk [MB]"}};
  for (const EvaluatedConfig& c : e.configs) {
    const auto& p = c.region_points;
    const auto regions = static_cast<double>(c.index.partition.size());
    const auto megabytes = static_cast<double>(c.bundle_bytes) / 1e6;
    TableRow row{.cells = {{c.name}, config_cell(c, "regions", regions, whole(regions))}};
    const auto points = [&](const char* name, double value) {
      row.cells.push_back(has_points(c) ? config_cell(c, name, value, whole(value)) : Cell{"–"});
    };
    points("points_per_region.min", p.min);
    points("points_per_region.mean", p.mean);
    points("points_per_region.max", p.max);
    points("points_per_region.std", p.std);
    row.cells.push_back(has_points(c) ? Cell{fmt::format("{:.2f} %", 100.0 * (1.0 - c.reduction()))}
                                      : Cell{"–"});
    row.cells.push_back(has_points(c) ? config_cell(c, "reduction", c.reduction(),
                                                    fmt::format("{:.2f} %", 100.0 * c.reduction()))
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
      "<p>Errors and scores are over tracked scans. Beneath a configuration stand its opponents: "
      "region maps with equal numbers of points, chosen without asking what can be seen. The best "
      "value of a column is green and bold. Opponents’ maps are made while driving, so their "
      "stalls would say nothing.</p>\n";
  for (const Block& block : blocks()) html += to_html(table_of(block, e));
  std::string none;
  for (const EvaluatedConfig& c : e.configs) {
    if (c.no_opponents.empty()) continue;
    none +=
        fmt::format("<li>{}: {}</li>\n", report::escaped(c.name), report::escaped(c.no_opponents));
  }
  if (!none.empty()) html += "<p>Without opponents:</p><ul>\n" + none + "</ul>\n";
  return html;
}

}  // namespace vantage::page
