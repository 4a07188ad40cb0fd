#include "localize/run_page.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

#include "report/chart.hpp"
#include "report/html.hpp"
#include "report/plan.hpp"
#include "terminal/counts.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage {
namespace {

using report::Axis;
using report::Cell;
using report::Curve;
using report::escaped;
using report::LinePanel;
using report::Marker;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The metrics that the page draws.
constexpr std::array<std::string_view, 11> kDrawn{
    "risk",     "fitness",   "coverage",   "nvtl",       "scan_ms",  "align_ms",
    "stall_ms", "search_ms", "held_bytes", "map_points", "map_bytes"};
/// The columns before theirs.
enum Place : std::size_t { kTime, kWay, kX, kY, kTracking, kRegion, kSwitched, kResident, kPlaces };

std::size_t column_of(std::string_view metric) {
  return kPlaces +
         static_cast<std::size_t>(std::find(kDrawn.begin(), kDrawn.end(), metric) - kDrawn.begin());
}

/// The memory of this process that is resident [bytes]; none where the system does not say.
double resident_bytes() {
  std::ifstream status("/proc/self/statm");
  double pages = kNone;
  status >> pages >> pages;
  return status ? pages * static_cast<double>(sysconf(_SC_PAGESIZE)) : kNone;
}

/// A reason without its numbers, so that equal ones can be counted.
std::string kind_of(const std::string& reason) {
  std::string kind;
  bool number = false;
  for (std::size_t i = 0; i < reason.size(); ++i) {
    const bool digit = reason[i] >= '0' && reason[i] <= '9';
    number = digit || (number && reason[i] == '.' && i + 1 < reason.size() && reason[i + 1] != ' ');
    if (!number) {
      kind += reason[i];
    } else if (!kind.ends_with("…")) {
      kind += "…";
    }
  }
  return kind;
}

/// The columns that several parts of the page need, a number for each scan.
struct Scans {
  std::vector<double> time, way, tracking;  ///< [s] since the first scan, [m], Tracking

  [[nodiscard]] std::size_t size() const { return time.size(); }
  [[nodiscard]] bool is(std::size_t i, Tracking state) const {
    return tracking[i] == static_cast<double>(state);
  }
};

// ---- verdict

/// Scans in a row of one state.
struct Stretch {
  std::size_t begin = 0, scans = 0;
  double seconds = 0.0, metres = 0.0;  ///< until the scan after it, or the last
};

Stretch longest(const Scans& scans, Tracking state) {
  Stretch longest;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!scans.is(i, state)) continue;
    const std::size_t begin = i;
    while (i < scans.size() && scans.is(i, state)) ++i;
    const std::size_t end = std::min(i, scans.size() - 1);
    const Stretch one{begin, i - begin, scans.time[end] - scans.time[begin],
                      scans.way[end] - scans.way[begin]};
    if (std::tie(one.seconds, one.scans) > std::tie(longest.seconds, longest.scans)) longest = one;
  }
  return longest;
}

std::string table_of_states(const Scans& scans, const RunSummary& summary) {
  report::Table table{
      .caption = "States of the scans",
      .groups = {{"", 3}, {"longest stretch", 4}},
      .header = {"state", "scans", "share [%]", "scans", "from scan", "[s]", "[m]"}};
  for (const Tracking state : {Tracking::tracked, Tracking::uncertain, Tracking::lost}) {
    const std::string name(to_string(state));
    const std::size_t count = state == Tracking::tracked ? summary.tracked : summary.count(name);
    report::TableRow row;
    row.cells = {
        {name},
        {cli::grouped(count), {{"metric", "scans." + name}, {"value", fmt::format("{}", count)}}},
        {fmt::format("{:.1f}", 100.0 * static_cast<double>(count) /
                                   static_cast<double>(std::max<std::size_t>(1, scans.size())))}};
    const Stretch stretch = longest(scans, state);
    if (stretch.scans == 0) {
      row.cells.insert(row.cells.end(), 4, Cell{"–"});
    } else {
      row.cells.push_back({cli::grouped(stretch.scans)});
      row.cells.push_back({cli::grouped(stretch.begin + 1)});
      row.cells.push_back({fmt::format("{:.1f}", stretch.seconds)});
      row.cells.push_back({fmt::format("{:.1f}", stretch.metres)});
    }
    table.rows.push_back(std::move(row));
  }
  return to_html(table);
}

std::string table_of_reasons(const std::map<std::string, std::size_t>& reasons) {
  if (reasons.empty()) return {};
  std::vector<std::pair<std::size_t, std::string>> sorted;
  for (const auto& [reason, scans] : reasons) sorted.emplace_back(scans, reason);
  std::sort(sorted.rbegin(), sorted.rend());
  report::Table table{.caption = "Why scans were not tracked", .header = {"reason", "scans"}};
  for (const auto& [scans, reason] : sorted) {
    table.rows.push_back({.cells = {{reason}, {cli::grouped(scans)}}});
  }
  return to_html(table);
}

std::string badge_of(const RunFacts& facts) {
  const RunSummary& s = facts.summary;
  if (facts.run.failure) return report::badge(false, "ended early");
  if (s.tracked == 0) return report::badge(false, "never tracked");
  if (s.count("lost") > 0) return report::badge(false, "lost at times");
  if (s.tracked == s.scans) return report::badge(true, "tracked throughout");
  return report::badge(10 * s.tracked >= 9 * s.scans, "never lost, uncertain at times");
}

std::string list_of(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<li>" + escaped(text) + "</li>\n";
  return html.empty() ? html : "<ul>\n" + html + "</ul>\n";
}

std::string verdict(const RunFacts& facts, const Scans& scans,
                    const std::map<std::string, std::size_t>& reasons) {
  std::string html = "<p>" + badge_of(facts);
  if (facts.run.failure) html += " " + escaped(to_string(*facts.run.failure));
  html += "</p>\n";
  const double metres = scans.way.back();
  const Stretch lost = longest(scans, Tracking::lost);
  std::vector<std::string> remarks{
      fmt::format("{:.1f} m driven in {:.1f} s, {}", metres, scans.time.back(),
                  facts.reference ? "along the reference" : "along the poses"),
      lost.scans == 0
          ? std::string("never lost")
          : fmt::format("longest lost stretch: {:.1f} s and {:.1f} m, {} from scan {} on",
                        lost.seconds, lost.metres, cli::counted(lost.scans, "scan"),
                        cli::grouped(lost.begin + 1))};
  remarks.insert(remarks.begin(), facts.remarks.begin(), facts.remarks.end());
  html += list_of(remarks);
  html += "<h3>What is suspicious</h3>\n";
  if (facts.notes.empty())
    html += "<p>Nothing was noticed about the map, the scans and the configuration.</p>\n";
  std::vector<std::string> notes;
  for (const checks::Note& note : facts.notes) notes.push_back(note.what + ": " + note.advice);
  html += list_of(notes) + table_of_states(scans, facts.summary) + table_of_reasons(reasons);
  return html +
         (facts.reference
              ? "<p>The run had a reference. This page does not use it: <code>vantage "
                "evaluate</code> compares with a reference.</p>\n"
              : "<p>Without a reference, nobody knows the errors. <code>vantage evaluate</code> "
                "compares with one.</p>\n");
}

// ---- curves over time

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

// ---- drive

/// What a part of the page reads of the scans.
using ColumnReader = std::function<Result<std::vector<double>>(std::size_t)>;

Result<std::string> borders(const RegionDirectory& regions, const report::PlanWindow& window) {
  constexpr std::size_t kMostBorders = 4000;
  VANTAGE_TRY(const auto seen, regions.meeting({window.min, window.max}));
  std::string d;
  if (seen.size() > kMostBorders) return d;
  for (const RegionId region : seen) {
    VANTAGE_TRY(const DirectoryEntry entry, regions.entry(region));
    d += report::outline(entry.region.footprint, window);
  }
  return report::border_path(d);
}

/// Places in a plan that are far enough from those before them to be seen beside them. The size of
/// the plan limits their number, not the length of the run.
class Spread {
 public:
  explicit Spread(double pixels) : pixels_(pixels) {}
  bool is_free(const Eigen::Vector2d& p, const report::PlanWindow& window) {
    const double x = window.x(p.x()), y = window.y(p.y());
    if (x < 0.0 || y < 0.0 || x > window.width || y > window.height()) return false;
    return taken_.emplace(std::lround(x / pixels_), std::lround(y / pixels_)).second;
  }

 private:
  double pixels_;
  std::set<std::pair<long, long>> taken_;
};

Result<std::string> drive(const RunFacts& facts, const Scans& scans, const ColumnReader& read) {
  VANTAGE_TRY(const auto x, read(kX));
  VANTAGE_TRY(const auto y, read(kY));
  VANTAGE_TRY(const auto region, read(kRegion));
  VANTAGE_TRY(const auto switched, read(kSwitched));
  VANTAGE_TRY(const auto risk, read(column_of("risk")));
  report::Extent tracked, all;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!std::isfinite(x[i])) continue;
    all.see({x[i], y[i]});
    if (scans.is(i, Tracking::tracked)) tracked.see({x[i], y[i]});
  }
  if (all.empty()) return std::string("<p>The sensor was never found.</p>\n");
  const report::PlanWindow window = report::window_of_drive(tracked.empty() ? all : tracked);
  const RunSummary& s = facts.summary;
  std::string svg = report::plan_opening(
      "Drive",
      fmt::format("{}, {} uncertain, {} lost, {}", cli::counted(s.scans, "scan"),
                  cli::grouped(s.count("uncertain")), cli::grouped(s.count("lost")),
                  cli::counted(s.count("switched"), "switch", "switches")),
      window);
  VANTAGE_TRY(const std::string lines, borders(facts.regions, window));
  svg += lines;
  Spread dots(3.0), rings(6.0), rhombs(6.0), crosses(6.0);
  std::string above;  // drawn last, because it must not be covered
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!std::isfinite(x[i])) continue;
    const Eigen::Vector2d p(x[i], y[i]);
    const std::string tip =
        fmt::format("scan {}, {:.1f} s, {:.0f} m\nrisk {}", cli::grouped(i + 1), scans.time[i],
                    scans.way[i], rounded(*find_metric("risk"), risk[i]));
    if (scans.is(i, Tracking::lost)) {
      if (crosses.is_free(p, window)) above += report::plan_cross(p, window, tip + "\nlost");
      continue;
    }
    if (switched[i] > 0.0 && i > 0 && rings.is_free(p, window)) {
      const RegionId id{static_cast<std::uint32_t>(region[i])};
      VANTAGE_TRY(const DirectoryEntry entry, facts.regions.entry(id));
      above += report::plan_ring(p, window, 4.0, tip + "\nswitched to " + entry.region.label);
    }
    if (scans.is(i, Tracking::uncertain)) {
      if (rhombs.is_free(p, window)) above += report::plan_rhomb(p, window, tip + "\nuncertain");
    } else if (dots.is_free(p, window)) {
      svg += report::plan_dot(p, window, "unknown", 2.3, tip);
    }
  }
  svg += above + report::scale_bar(window) + report::plan_end();
  return "<p class=\"legend\"><span><i class=\"dot unknown\"></i>scan tracked</span> " +
         report::legend_of_drive() + "</p>\n" +
         report::figure(
             {svg},
             "Poses of the run. Where scans lie closer than they can be drawn, the first "
             "stands for them. The pose of a lost scan is a prediction.",
             "drive");
}

// ---- figures over time

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

}  // namespace

RunPage::RunPage(const std::filesystem::path& folder) : values_(kPlaces + kDrawn.size(), folder) {}

Result<void> RunPage::add(const RunScan& scan) {
  constexpr std::size_t kMostReasons = 64;
  const ScanReport& r = scan.report;
  if (!first_stamp_) first_stamp_ = r.stamp;
  const auto& at = r.T_map_scan.translation;
  const std::array<double, kPlaces> places{
      r.stamp - *first_stamp_,         odometer_(scan),
      r.has_pose ? at.x() : kNone,     r.has_pose ? at.y() : kNone,
      static_cast<double>(r.tracking), static_cast<double>(r.region.value),
      r.switched ? 1.0 : 0.0,          resident_bytes()};
  for (std::size_t place = 0; place < kPlaces; ++place) {
    VANTAGE_CHECK(values_.push(place, places[place]));
  }
  for (const std::string_view key : kDrawn) {
    const Metric& metric = *find_metric(key);
    const auto x = metric.value(scan);
    VANTAGE_CHECK(values_.push(column_of(key), x ? metric.unit->scale * *x : kNone));
  }
  if (r.reason.empty()) return {};
  const std::string reason = fmt::format("{}: {}", to_string(r.tracking), kind_of(r.reason));
  if (reasons_.size() < kMostReasons || reasons_.contains(reason)) ++reasons_[reason];
  return {};
}

Result<std::string> RunPage::html(const RunFacts& facts) const {
  const ColumnReader read = [&](std::size_t column) { return values_.read(column); };
  Scans scans;
  VANTAGE_TRY(scans.time, read(kTime));
  VANTAGE_TRY(scans.way, read(kWay));
  VANTAGE_TRY(scans.tracking, read(kTracking));
  VANTAGE_TRY(std::string driven, drive(facts, scans, read));
  VANTAGE_TRY(std::string risks, risk_over_time(facts, scans, read));
  VANTAGE_TRY(std::string fits, fit_over_time(scans, read));
  VANTAGE_TRY(std::string stalls, times(facts, scans, read));
  VANTAGE_TRY(std::string bytes, memory(scans, read));
  return to_html(report::Page{
      .title = "A run in region maps",
      .subtitle = fmt::format("{}, {} in {}", facts.run.config, cli::counted(scans.size(), "scan"),
                              cli::counted(facts.run.regions, "region")),
      .sections = {{"verdict", "Verdict", verdict(facts, scans, reasons_)},
                   {"drive", "Drive", std::move(driven)},
                   {"risk", "Risk", std::move(risks)},
                   {"fit", "Fit", std::move(fits)},
                   {"times", "Stalls and times", std::move(stalls)},
                   {"memory", "Memory", std::move(bytes)}}});
}

}  // namespace vantage
