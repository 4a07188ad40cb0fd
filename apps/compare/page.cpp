#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "compare/page.hpp"
#include "report/chart.hpp"
#include "report/html.hpp"
#include "terminal/counts.hpp"

namespace vantage {
namespace {

using report::escaped;

std::string label(const Compared& q) { return heading(*q.metric); }

/// Where the axis of a metric begins at 0 anyway.
bool from_zero(const Compared& q) { return q.metric->better == Better::less; }

std::vector<double> both(const Compared& q) {
  std::vector<double> all = q.a;
  all.insert(all.end(), q.b.begin(), q.b.end());
  return all;
}

/// Values of one run over the distance travelled; a pair without a value is a gap.
std::vector<Eigen::Vector2d> over_way(const Comparison& c, const Compared& q,
                                      const std::vector<double>& values) {
  const auto& way = c.a.columns.at("distance_m");
  std::vector<Eigen::Vector2d> curve;
  std::size_t last = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0 && q.pairs[i] != last + 1) {
      curve.emplace_back(0.0, std::numeric_limits<double>::quiet_NaN());
    }
    last = q.pairs[i];
    curve.emplace_back(way[c.pairs[last].a].value_or(static_cast<double>(i)), values[i]);
  }
  return curve;
}

report::Axis way_axis(const Comparison& c) {
  double longest = 1.0;
  for (const auto& way : c.a.columns.at("distance_m"))
    longest = std::max(longest, way.value_or(0.0));
  return report::linear_axis("distance along the route [m]", 0.0, longest, 8);
}

std::string lines(const Comparison& c, const Compared& q) {
  const report::LinePanel values{std::string(q.metric->name) + " along the route",
                                 way_axis(c),
                                 report::axis_over(label(q), both(q), true, 5),
                                 {{"A", {0, report::Marker::disc}, over_way(c, q, q.a)},
                                  {"B", {1, report::Marker::disc}, over_way(c, q, q.b)}}};
  std::vector<double> difference;
  for (std::size_t i = 0; i < q.a.size(); ++i) difference.push_back(q.b[i] - q.a[i]);
  std::vector<double> ends = difference;
  ends.push_back(0.0);
  const auto [low, high] = std::minmax_element(ends.begin(), ends.end());
  const report::LinePanel differences{
      std::string(q.metric->name) + ", B − A",
      way_axis(c),
      report::linear_axis(label(q), *low, *high, 5),
      {{"B − A", {6, report::Marker::disc}, over_way(c, q, difference)}}};
  return report::figure({to_svg(values, 560.0, 210.0), to_svg(differences, 560.0, 210.0)},
                        "Along the route. Right: B is smaller where the curve is below 0.",
                        std::string(q.metric->key) + "-way");
}

std::string cumulative(const Compared& q) {
  report::Axis share{.label = "share of scans below", .ticks = {}};
  for (const int percent : {0, 25, 50, 75, 100}) {
    share.ticks.push_back({0.01 * percent, fmt::format("{} %", percent)});
  }
  const report::LinePanel panel{std::string(q.metric->name) + ", cumulative",
                                report::axis_over(label(q), both(q), true, 8),
                                share,
                                {{"A", {0, report::Marker::disc}, report::cumulative(q.a)},
                                 {"B", {1, report::Marker::disc}, report::cumulative(q.b)}}};
  return to_svg(panel, 560.0, 180.0);
}

std::string box(const Compared& q) {
  return to_svg(
      report::RowPanel{label(q),
                       report::axis_over(label(q), both(q), from_zero(q)),
                       {{.name = "A", .look = {0, report::Marker::disc}, .sample = q.a},
                        {.name = "B", .look = {1, report::Marker::disc}, .sample = q.b}}});
}

report::Table table(const Comparison& c) {
  const auto rows = rows_of(c);
  report::Table table{.caption = "Means over scans in both runs", .header = rows.front()};
  for (std::size_t i = 1; i < rows.size(); ++i) {
    report::TableRow row;
    for (const std::string& cell : rows[i]) row.cells.push_back({cell});
    if (i - 1 < c.quantities.size()) {
      const Compared& q = c.quantities[i - 1];
      row.cells[2].data = {{"metric", std::string(q.metric->key) + ".a"},
                           {"value", fmt::format("{}", q.mean_a)}};
      row.cells[3].data = {{"metric", std::string(q.metric->key) + ".b"},
                           {"value", fmt::format("{}", q.mean_b)}};
      row.cells[4].data = {{"metric", std::string(q.metric->key) + ".difference"},
                           {"value", fmt::format("{}", q.difference)}};
      // Counts as better only if chance is an unlikely explanation.
      const bool sure = q.interval.low > 0.0 || q.interval.high < 0.0;
      const bool b = (q.difference < 0.0) == (q.metric->better == Better::less);
      row.cells[b ? 3 : 2].best = sure && q.metric->better != Better::neither;
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

std::string to_html(const Comparison& c) {
  const auto file = [](const char* name, const ScanTable& t) {
    return fmt::format("<li><strong>{}</strong>: <code>{}</code>, {}</li>\n", name,
                       escaped(t.file.string()), cli::counted(t.size(), "scan"));
  };
  report::Page page{.title = "Two runs side by side", .subtitle = pairing_text(c), .sections = {}};
  page.sections.push_back(
      {"summary", "Summary",
       "<ul>" + file("A", c.a) + file("B", c.b) + "</ul>\n" + to_html(table(c)) +
           "<p>Errors and scores are of scans tracked in both runs. The interval is that of the "
           "mean difference of pairs, from 2,000 resamples; it treats scans as independent, so the "
           "true interval is wider for scans that follow each other closely. Green and bold: "
           "better, with 0 outside the interval.</p>\n"});
  std::string error;
  std::vector<std::string> match, cost;
  for (const Compared& q : c.quantities) {
    switch (q.metric->group) {
      case MetricGroup::error:
        error += lines(c, q);
        error +=
            report::figure({cumulative(q), box(q)}, "Share of scans, and box with mean as diamond.",
                           std::string(q.metric->key) + "-share");
        break;
      case MetricGroup::match: match.push_back(box(q)); break;
      case MetricGroup::map:
      case MetricGroup::scans:
      case MetricGroup::time: cost.push_back(box(q)); break;
    }
  }
  page.sections.push_back(
      {"error", "Error", error.empty() ? "<p>No scan has an error in both runs.</p>\n" : error});
  if (!match.empty()) {
    page.sections.push_back(
        {"match", "Match",
         report::figure(match,
                        "Fitness alone rewards deleting map: read it with coverage and error.",
                        "match")});
  }
  if (!cost.empty()) {
    page.sections.push_back(
        {"cost", "Time and size", report::figure(cost, "Of all pairs.", "cost")});
  }
  return to_html(page);
}

}  // namespace vantage
