#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "localize/run_parts.hpp"
#include "report/chart.hpp"
#include "report/html.hpp"
#include "terminal/counts.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage::run_page {
namespace {

using report::Axis;
using report::LinePanel;
using report::Marker;

Axis time_axis(const Scans& scans) {
  return report::linear_axis("time since the first scan [s]", 0.0,
                             std::max(scans.time.back(), 1e-3), 8);
}

std::vector<Eigen::Vector2d> over_time(const Scans& scans, const std::vector<double>& values) {
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < scans.size(); ++i) points.emplace_back(scans.time[i], values[i]);
  return points;
}

bool any(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

constexpr std::size_t kMostMarks = 300;

/// Marks where scans are uncertain or lost.
void add_states(LinePanel& panel, const Scans& scans, const std::vector<double>& values) {
  for (const auto& [state, look] :
       {std::pair(Tracking::uncertain, report::Look{6, Marker::diamond}),
        std::pair(Tracking::lost, report::Look{1, Marker::square})}) {
    std::vector<Eigen::Vector2d> points;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      if (scans.is(i, state) && std::isfinite(values[i]))
        points.emplace_back(scans.time[i], values[i]);
    }
    if (points.empty()) continue;
    panel.curves.push_back({std::string(to_string(state)), look,
                            report::thinned(std::move(points), kMostMarks), true});
  }
}

/// The caption of a panel with `add_states`.
std::string caption_of(const LinePanel& panel, std::size_t curves, std::string text) {
  if (panel.curves.size() > curves) text += " Marks: scans that were uncertain or lost.";
  return text;
}

/// A figure of a metric over time; nothing if no scan has a value.
Result<std::string> metric_figure(const Scans& scans, const ColumnReader& read,
                                  std::string_view key, bool from_zero, const char* caption) {
  VANTAGE_TRY(const auto values, read(column_of(key)));
  if (!any(values)) return std::string();
  const Metric& metric = *find_metric(key);
  LinePanel panel{std::string(metric.name),
                  time_axis(scans),
                  report::axis_over(heading(metric), values, from_zero, 5),
                  {{"all scans", {}, over_time(scans, values)}}};
  add_states(panel, scans, values);
  return report::figure({to_svg(panel, 560.0, 210.0)}, caption_of(panel, 1, caption), key);
}

std::string table_of_times(const RunSummary& summary) {
  report::Table table{.caption = "Times of a scan",
                      .header = {"", "scans", "mean", "median", "p95", "p99", "max"}};
  for (const Metric* metric : metrics_by_group()) {
    const Statistics x = summary[metric->key];
    if (metric->group != MetricGroup::time || x.count == 0) continue;
    report::TableRow row{.cells = {{heading(*metric)}, {cli::grouped(x.count)}}};
    for (const NamedStatistic& statistic : statistics_in("mean median p95 p99 max")) {
      const double value = x.*statistic.member;
      row.cells.push_back({shown(*metric, value),
                           {{"metric", fmt::format("{}.{}", metric->key, statistic.name)},
                            {"value", fmt::format("{}", value)}}});
    }
    table.rows.push_back(std::move(row));
  }
  return to_html(table);
}

/// How many scans took longer than the time to the next one.
std::string pace(const Scans& scans, const std::vector<double>& took) {
  std::vector<double> gaps;  // [ms]
  std::size_t late = 0;
  for (std::size_t i = 0; i + 1 < scans.size(); ++i) {
    gaps.push_back(1e3 * (scans.time[i + 1] - scans.time[i]));
    if (took[i] > gaps.back()) ++late;
  }
  if (gaps.empty()) return {};
  return fmt::format("{} of {} took longer than the time to the next one (median {:.0f} ms). ",
                     cli::grouped(late), cli::counted(scans.size(), "scan"),
                     statistics_of(gaps).median);
}

}  // namespace

Result<std::string> risk_over_time(const RunFacts& facts, const Scans& scans,
                                   const ColumnReader& read) {
  VANTAGE_TRY(const auto risk, read(column_of("risk")));
  if (!any(risk)) return std::string("<p>No scan has a pose.</p>\n");
  LinePanel panel{"Integrity risk",
                  time_axis(scans),
                  report::risk_axis(risk),
                  {{"all scans", {}, over_time(scans, risk)},
                   {"max_risk",
                    {7, Marker::ring},
                    {{0.0, facts.max_risk}, {scans.time.back(), facts.max_risk}}}}};
  add_states(panel, scans, risk);
  return fmt::format(
             "<p>The integrity risk is the localizer’s own estimate of the probability that a pose "
             "is off by more than the alert limit ({:g} m or {:g}°). A scan above "
             "<code>max_risk</code> is not tracked.</p>\n",
             facts.run.alert_limit.metres, facts.run.alert_limit.degrees) +
         report::figure(
             {to_svg(panel, 560.0, 240.0)},
             caption_of(
                 panel, 2,
                 "Risk of every scan that has a pose. A gap in the curve is a scan without one."),
             "risk");
}

Result<std::string> fit_over_time(const Scans& scans, const ColumnReader& read) {
  std::string figures;
  for (const auto& [key, caption] :
       {std::pair("coverage",
                  "Share of a scan’s points that have a part of the map near them. A "
                  "low one means a map that changed, or a wrong pose."),
        std::pair("nvtl", "How well the points fit that have a part of the map near them."),
        std::pair("fitness", "S<sub>fitness</sub> (Eq. 12); a point without map counts 0.")}) {
    VANTAGE_TRY(const std::string one, metric_figure(scans, read, key, false, caption));
    figures += one;
  }
  return figures.empty() ? std::string("<p>No scan was matched.</p>\n")
                         : report::side_by_side(figures);
}

Result<std::string> times(const RunFacts& facts, const Scans& scans, const ColumnReader& read) {
  const RunSummary& s = facts.summary;
  constexpr double kLeast = 0.1;  // that is shown as waiting [ms]
  LinePanel panel{"Time of a scan", time_axis(scans), {}, {}};
  std::string late;
  std::vector<double> all;
  std::size_t colour = 0;
  for (const char* key : {"scan_ms", "align_ms", "stall_ms", "search_ms"}) {
    VANTAGE_TRY(auto values, read(column_of(key)));
    if (colour == 0) late = pace(scans, values);
    const bool rare = colour > 1;  // most scans neither wait nor search
    if (rare) {
      std::replace_if(
          values.begin(), values.end(), [](double ms) { return ms < kLeast; }, kNone);
    }
    all.insert(all.end(), values.begin(), values.end());
    std::vector<Eigen::Vector2d> points = over_time(scans, values);
    if (rare) {
      std::erase_if(points, [](const auto& p) { return !std::isfinite(p.y()); });
      points = report::thinned(std::move(points), kMostMarks);
    }
    const report::Look look{colour++, rare ? Marker::ring : Marker::disc};
    if (any(values)) {
      panel.curves.push_back({std::string(find_metric(key)->name), look, std::move(points), rare});
    }
  }
  panel.y = report::axis_over("time [ms]", all, true, 5);
  return fmt::format("<p>{}{}; {} waited for a map, {:.1f} ms at most.</p>\n", late,
                     cli::counted(s.count("switched"), "switch of maps", "switches of maps"),
                     cli::counted(s.count("blocked"), "scan"), s["stall_ms"].max) +
         report::figure({to_svg(panel, 560.0, 240.0)},
                        "The whole scan, from its points to its pose; its matching; and, as marks, "
                        "how long it waited for a map or searched for the sensor.",
                        "times") +
         table_of_times(s);
}

Result<std::string> memory(const Scans& scans, const ColumnReader& read) {
  VANTAGE_TRY(auto resident, read(kResident));
  VANTAGE_TRY(const auto held, read(column_of("held_bytes")));
  for (double& bytes : resident) bytes *= 1e-6;
  std::vector<double> both = resident;
  both.insert(both.end(), held.begin(), held.end());
  LinePanel panel{"Memory", time_axis(scans), report::axis_over("memory [MB]", both, true, 5), {}};
  if (any(resident)) {
    panel.curves.push_back({"process", {0, Marker::disc}, over_time(scans, resident)});
  }
  panel.curves.push_back({"maps that are ready", {1, Marker::disc}, over_time(scans, held)});
  std::string figures = report::figure(
      {to_svg(panel, 560.0, 210.0)},
      "What the process holds in memory, programs and scans included, and the maps in it.",
      "memory");
  for (const auto& [key, caption] :
       {std::pair("map_points", "Points of the map that the scan was matched against."),
        std::pair("map_bytes", "Size of that map in the bundle.")}) {
    VANTAGE_TRY(const std::string one, metric_figure(scans, read, key, true, caption));
    figures += one;
  }
  return report::side_by_side(figures);
}

}  // namespace vantage::run_page
