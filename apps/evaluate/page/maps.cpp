#include "evaluate/page/maps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "evaluate/page/error_classes.hpp"
#include "evaluate/page/samples.hpp"
#include "evaluate/page/tables.hpp"
#include "report/chart.hpp"
#include "report/html.hpp"
#include "report/plan.hpp"
#include "report/points.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage::page {
namespace {

using report::escaped;
using report::Extent;
using report::plan_end;
using report::plan_opening;
using report::PlanWindow;

std::string borders(const Partition& partition, const PlanWindow& window) {
  std::string d;
  for (const Region& region : partition.regions()) d += report::outline(region.footprint, window);
  return report::border_path(d);
}

// ---- Fig. 9

/// Visits at least some of the points, evenly picked.
template <class F>
void each_of_some(PointsView points, std::size_t most, const F& draw) {
  const std::size_t step = std::max<std::size_t>(1, (points.size() + most - 1) / most);
  for (std::size_t i = 0; i < points.size(); i += step) draw(points[i]);
}

/// Extends a box to a specimen's region and most of its points: a tenth of the points may lie
/// outside.
void see_specimen(Extent& extent, const EvaluatedConfig& config) {
  const Specimen& specimen = *config.specimen;
  const bool whole = config.index.regions.size() == 1;
  if (!whole) {
    const auto& footprint = config.index.partition[specimen.region].footprint;
    for (const Eigen::Vector2d& p : report::outline_lines(footprint)) extent.see(p);
  }
  std::array<std::vector<double>, 2> sides;
  for (const Point& p : specimen.points) {
    sides[0].push_back(p.x());
    sides[1].push_back(p.y());
  }
  if (whole || sides[0].empty()) return;
  Eigen::Vector2d low, high;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    auto& v = sides[axis];
    std::sort(v.begin(), v.end());
    low[static_cast<Eigen::Index>(axis)] = v[v.size() / 50];
    high[static_cast<Eigen::Index>(axis)] = v[v.size() - 1 - v.size() / 50];
  }
  extent.see(low);
  extent.see(high);
}

std::string legend_of_heights(const PlanWindow& window, const report::Heights& heights,
                              std::size_t number) {
  const double x = window.width - 152.0, y = window.height() - 30.0;
  return fmt::format(
      "<defs><linearGradient id=\"heights{0}\">{1}</linearGradient></defs><rect class=\"plate\" "
      "x=\"{2:.0f}\" y=\"{3:.1f}\" width=\"144\" height=\"34\" rx=\"4\"/><rect x=\"{4:.0f}\" "
      "y=\"{5:.1f}\" width=\"124\" height=\"7\" fill=\"url(#heights{0})\"/><text class=\"tick\" "
      "x=\"{4:.0f}\" y=\"{6:.1f}\">{7:.1f} m</text><text class=\"tick\" x=\"{8:.0f}\" "
      "y=\"{6:.1f}\" text-anchor=\"end\">{9:.1f} m</text>",
      number, report::height_gradient_stops(), x, y - 12.0, x + 10.0, y - 6.0, y + 14.0,
      heights.low, x + 134.0, heights.high);
}

Result<std::string> specimen_svg(const EvaluatedConfig& config, std::size_t number,
                                 const PlanWindow& window, const report::Heights& heights,
                                 bool over_map) {
  const Specimen& specimen = *config.specimen;
  const Region& region = config.index.partition[specimen.region];
  VANTAGE_TRY(const std::string png,
              report::height_picture(specimen.points, window, heights.low, heights.high));
  std::string svg = plan_opening(report::shortened(config.name, 26),
                                 fmt::format("region {}, {}", report::shortened(region.label, 24),
                                             cli::counted(specimen.points.size(), "point")),
                                 window);
  if (over_map) svg += "<use class=\"ground\" href=\"#map-of-specimens\"/>\n";
  svg += fmt::format("<image width=\"{:.0f}\" height=\"{:.1f}\" href=\"{}\"/>\n", window.width,
                     window.height(), png);
  if (config.index.regions.size() > 1) {
    const std::string d = report::outline(region.footprint, window);
    svg +=
        fmt::format("<path class=\"here halo\" d=\"{0}\"/><path class=\"here\" d=\"{0}\"/>\n", d);
  }
  each_of_some(specimen.viewpoints, 1500, [&](const Point& p) {
    const double x = window.x(p.x()), y = window.y(p.y());
    if (x < 0.0 || y < 0.0 || x > window.width || y > window.height()) return;
    svg += fmt::format("<circle class=\"viewpoint\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"1.6\"/>", x, y);
  });
  svg += report::scale_bar(window) + legend_of_heights(window, heights, number);
  return svg + plan_end();
}

// ---- trajectories

std::string tip_of(const Run& run, std::size_t i, double way) {
  const RunScan& scan = run.scans[i];
  std::string text = fmt::format("scan {}, {:.0f} m, {}", i + 1, way, scan.region);
  if (scan.error) {
    text += fmt::format("\n{:.1f} cm, {:.2f}°", 100.0 * scan.error->metres, scan.error->degrees);
  }
  if (scan.report.switched) text += "\nswitched to this region";
  text += fmt::format("\nrisk {}", shown(*find_metric("risk"), scan.report.risk));
  if (is_tracked(scan)) return text;
  text += fmt::format("\n{}", to_string(scan.report.tracking));
  return scan.report.reason.empty() ? text : text + ": " + scan.report.reason;
}

std::string trajectory_svg(const Evaluation& e, const MapRun& r, const PlanWindow& window) {
  const Run& run = r.run->run;
  const std::string title = e.routes.size() == 1
                                ? r.config->name
                                : fmt::format("{}, {}", r.config->name, e.routes[r.route].name);
  const RunSummary& s = r.run->summary;
  std::string svg =
      plan_opening(title,
                   fmt::format("{}, {} uncertain, {} lost, {}", cli::counted(s.scans, "scan"),
                               cli::grouped(s.count("uncertain")), cli::grouped(s.count("lost")),
                               cli::counted(s.count("switched"), "switch", "switches")),
                   window);
  if (!e.map.empty())
    svg += fmt::format("<use class=\"ground\" href=\"#map-of-route{}\"/>\n", r.route);
  svg += borders(r.config->index.partition, window);
  std::string reference;
  for (const auto& moment : e.routes[r.route].reference) {
    reference += report::polyline_point(moment.pose.translation.head<2>(), window);
  }
  svg += fmt::format("<polyline class=\"reference\" points=\"{}\"/>\n", reference);
  const std::vector<double> way = distances(run);
  // Rings that would touch each other are smaller: what they are around has to be seen.
  const double apart = way.empty()
                           ? 0.0
                           : way.back() * window.pixels_per_metre() /
                                 static_cast<double>(std::max<std::size_t>(s.count("switched"), 1));
  const double ring = std::clamp(0.3 * apart, 2.6, 4.8);
  std::string above;  // drawn last, because it must not be covered
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const RunScan& scan = run.scans[i];
    if (!scan.report.has_pose) continue;
    const Eigen::Vector2d p = scan.report.T_map_scan.translation.head<2>();
    const std::string tip = tip_of(run, i, way[i]);
    if (scan.report.tracking == Tracking::lost) {
      above += report::plan_cross(p, window, tip);
      continue;
    }
    if (scan.report.switched && i > 0) above += report::plan_ring(p, window, ring, tip);
    if (scan.report.tracking == Tracking::uncertain) {
      above += report::plan_rhomb(p, window, tip);
      continue;
    }
    const Number error = shown_value("error_m", scan);
    svg += report::plan_dot(
        p, window, error ? fmt::format("e{}", error_class_of(*error)) : "unknown", 2.3, tip);
  }
  return svg + above + report::scale_bar(window) + plan_end();
}

std::string trajectory_legend() {
  return "<p class=\"legend\">" + error_class_legend() + report::legend_of_drive() + "</p>\n";
}

PlanWindow window_of_route(const Evaluation& e, std::size_t route) {
  Extent extent;
  for (const auto& moment : e.routes[route].reference)
    extent.see(moment.pose.translation.head<2>());
  for (const MapRun& r : runs_of(e, route)) {
    if (!r.own()) continue;
    for (const RunScan& scan : r.run->run.scans) {
      if (is_tracked(scan)) extent.see(scan.report.T_map_scan.translation.head<2>());
    }
  }
  return report::window_of_drive(extent);
}

}  // namespace

Result<std::string> region_maps(const Evaluation& e) {
  Extent extent;
  PointCloud heights_of;
  std::string missing;
  for (const EvaluatedConfig& config : e.configs) {
    if (!config.specimen) {
      missing += fmt::format("{}{}", missing.empty() ? "" : ", ", escaped(config.name));
      continue;
    }
    see_specimen(extent, config);
  }
  const EvaluatedConfig* shown = nullptr;
  for (const EvaluatedConfig& config : e.configs) {
    if (config.specimen && (shown == nullptr || config.index.regions.size() > 1)) shown = &config;
  }
  if (shown == nullptr) {
    return std::string(
        "<p>No bundle holds points: region maps that are ready to match against cannot be "
        "drawn.</p>\n");
  }
  if (extent.empty()) {
    for (const Point& p : shown->specimen->points) extent.see(p.head<2>());
  }
  if (extent.empty()) extent.see(Eigen::Vector2d::Zero());
  const PlanWindow window = report::window_around(extent.low, extent.high, 8.0, 40.0, 560.0, 560.0);
  const report::Heights heights = report::heights_of(shown->specimen->points);

  std::string html = fmt::format(
      "<p>The region map that each configuration uses halfway along “{}”, from above, over the "
      "wide-area map in grey. All panels have the same scale; of a whole map, they show the same "
      "part.</p>\n",
      escaped(e.routes.empty() ? "" : e.routes.front().name));
  if (!e.map.empty()) {
    VANTAGE_TRY(const std::string png, report::density_picture(e.map, window));
    html += report::shared_picture("map-of-specimens", window, png);
  }
  std::vector<std::string> panels;
  for (std::size_t c = 0; c < e.configs.size(); ++c) {
    if (!e.configs[c].specimen) continue;
    VANTAGE_TRY(std::string svg, specimen_svg(e.configs[c], c, window, heights, !e.map.empty()));
    panels.push_back(std::move(svg));
  }
  html += report::figure(
      panels,
      "Fig. 9. Region maps, coloured by height. Line: border of the local region; "
      "white dots: virtual viewpoints. What is seen from a region reaches beyond it.",
      "fig9-region-map");
  if (!missing.empty()) {
    html += "<p>Without points, so not drawn: " + missing + ".</p>\n";
  }
  return html;
}

Result<std::string> trajectories(const Evaluation& e) {
  std::string html = trajectory_legend();
  for (std::size_t route = 0; route < e.routes.size(); ++route) {
    const PlanWindow window = window_of_route(e, route);
    if (e.routes.size() > 1) html += "<h3>" + escaped(e.routes[route].name) + "</h3>\n";
    if (!e.map.empty()) {
      VANTAGE_TRY(const std::string png, report::density_picture(e.map, window));
      html += report::shared_picture(fmt::format("map-of-route{}", route), window, png);
    }
    std::vector<std::string> panels;
    for (const MapRun& r : runs_of(e, route)) {
      if (r.own()) panels.push_back(trajectory_svg(e, r, window));
    }
    html +=
        report::figure(panels,
                       "Estimated positions; those of tracked scans are coloured by error. Grey "
                       "line: reference.",
                       fmt::format("trajectory-{}", route + 1));
  }
  return html;
}

}  // namespace vantage::page
