#include "evaluate/page/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "evaluate/page/samples.hpp"
#include "evaluate/page/tables.hpp"
#include "report/chart.hpp"
#include "report/html.hpp"
#include "terminal/counts.hpp"

namespace vantage::page {
namespace {

using report::Axis;
using report::Curve;
using report::LinePanel;
using report::Look;
using report::Marker;
using report::Row;
using report::RowPanel;

Marker marker_of(std::string_view map) {
  if (map == kOwnMap) return Marker::disc;
  if (map == "random") return Marker::ring;
  if (map == "voxel") return Marker::square;
  if (map == "radius") return Marker::triangle;
  return Marker::diamond;
}

Look look_of(const MapRun& r) { return {r.config_number, marker_of(r.map)}; }

std::string name_of(const MapRun& r) { return r.own() ? r.config->name : std::string(r.map); }

/// "T_align" for a single route; the title names the route if there are several.
std::string title_of(const Evaluation& e, const std::string& what, std::size_t route) {
  return e.routes.size() == 1 ? what : fmt::format("{}, {}", what, e.routes[route].name);
}

/// All values of something on all routes: figures of different routes share an axis.
std::vector<double> everything(const Evaluation& e, std::string_view metric,
                               bool baselines = true) {
  std::vector<double> all;
  for (std::size_t route = 0; route < e.routes.size(); ++route) {
    for (const MapRun& r : runs_of(e, route)) {
      if (!baselines && !r.own()) continue;
      const auto sample = sample_of(r.run->run, metric);
      all.insert(all.end(), sample.begin(), sample.end());
    }
  }
  return all;
}

std::vector<std::string> boxes(const Evaluation& e, const std::string& what,
                               const std::string& label, std::string_view metric, bool from_zero) {
  const Axis axis = report::axis_over(label, everything(e, metric), from_zero);
  std::vector<std::string> panels;
  for (std::size_t route = 0; route < e.routes.size(); ++route) {
    RowPanel panel{.title = title_of(e, what, route), .x = axis, .rows = {}};
    for (const MapRun& r : runs_of(e, route)) {
      panel.rows.push_back({.name = name_of(r),
                            .look = look_of(r),
                            .beneath = !r.own(),
                            .sample = sample_of(r.run->run, metric)});
    }
    panels.push_back(to_svg(panel));
  }
  return panels;
}

std::vector<std::string> region_dots(const Evaluation& e, const std::string& what,
                                     const std::string& label, std::string_view metric) {
  std::vector<RowPanel> panels;
  std::vector<double> all;
  for (std::size_t route = 0; route < e.routes.size(); ++route) {
    RowPanel panel{.title = title_of(e, what, route), .x = {}, .rows = {}};
    panel.style = report::RowStyle::dots;
    for (const MapRun& r : runs_of(e, route)) {
      Row row{.name = name_of(r), .look = look_of(r), .beneath = !r.own(), .sample = {}};
      for (const RegionMean& mean : by_region(r.run->run, metric)) {
        row.sample.push_back(mean.mean);
        row.tips.push_back(fmt::format("{}: {:.4g}, {}",
                                       r.config->index.partition[mean.region].label, mean.mean,
                                       cli::counted(mean.scans, "scan")));
        all.push_back(mean.mean);
      }
      panel.rows.push_back(std::move(row));
    }
    panels.push_back(std::move(panel));
  }
  std::vector<std::string> drawn;
  for (RowPanel& panel : panels) {
    panel.x = report::axis_over(label, all, true);
    drawn.push_back(to_svg(panel));
  }
  return drawn;
}

double longest_way(const Evaluation& e, std::size_t route) {
  double longest = 1.0;
  for (const MapRun& r : runs_of(e, route)) {
    const auto way = distances(r.run->run);
    if (!way.empty()) longest = std::max(longest, way.back());
  }
  return longest;
}

/// One curve per configuration over the distance travelled.
std::vector<std::string> lines(const Evaluation& e, const std::string& what, const Axis& y,
                               std::string_view metric) {
  std::vector<std::string> panels;
  for (std::size_t route = 0; route < e.routes.size(); ++route) {
    LinePanel panel{
        .title = title_of(e, what, route),
        .x = report::linear_axis("distance along the route [m]", 0.0, longest_way(e, route), 8),
        .y = y,
        .curves = {}};
    for (const MapRun& r : runs_of(e, route)) {
      if (!r.own()) continue;
      panel.curves.push_back({name_of(r), look_of(r), over_distance(r.run->run, metric)});
    }
    panels.push_back(to_svg(panel, 560.0, 210.0));
  }
  return panels;
}

std::vector<std::string> lines(const Evaluation& e, const std::string& what,
                               const std::string& label, std::string_view metric, bool from_zero) {
  return lines(e, what, report::axis_over(label, everything(e, metric, false), from_zero, 5),
               metric);
}

/// The cumulative distribution of a metric over one run.
Curve cumulative_curve(const MapRun& r, std::string_view metric) {
  return {name_of(r), look_of(r),
          report::thinned(report::cumulative(sample_of(r.run->run, metric)), 240)};
}

Axis share_axis() {
  Axis axis{.label = "share of tracked scans below", .ticks = {}};
  for (const int percent : {0, 25, 50, 75, 100}) {
    axis.ticks.push_back({0.01 * percent, fmt::format("{} %", percent)});
  }
  return axis;
}

std::vector<std::string> cumulative_of_configs(const Evaluation& e, const Axis& x) {
  std::vector<std::string> panels;
  for (std::size_t route = 0; route < e.routes.size(); ++route) {
    LinePanel panel{title_of(e, "Error, all configurations", route), x, share_axis(), {}};
    for (const MapRun& r : runs_of(e, route)) {
      if (r.own()) panel.curves.push_back(cumulative_curve(r, "error_m"));
    }
    panels.push_back(to_svg(panel, 560.0, 210.0));
  }
  return panels;
}

std::vector<std::string> cumulative_of_baselines(const Evaluation& e, const Axis& x) {
  std::vector<std::string> panels;
  for (std::size_t c = 0; c < e.configs.size(); ++c) {
    if (e.configs[c].baselines.empty()) continue;
    for (std::size_t route = 0; route < e.routes.size(); ++route) {
      LinePanel panel{
          title_of(e, e.configs[c].name + " and its baselines", route), x, share_axis(), {}};
      for (const MapRun& r : runs_of(e, route)) {
        if (r.config_number == c) panel.curves.push_back(cumulative_curve(r, "error_m"));
      }
      panels.push_back(to_svg(panel, 560.0, 190.0));
    }
  }
  return panels;
}

/// What the bytes of a map buy: each configuration as a mark, its mean error over the mean size of
/// the maps in use. Nothing for routes on which nothing was measured.
std::vector<std::string> errors_by_bytes(const Evaluation& e) {
  std::vector<LinePanel> panels;
  std::vector<double> bytes, errors;
  for (std::size_t route = 0; route < e.routes.size(); ++route) {
    LinePanel panel{title_of(e, "What bytes buy", route), {}, {}, {}};
    for (const MapRun& r : runs_of(e, route)) {
      const Eigen::Vector2d at(1e-3 * r.run->summary["map_bytes"].mean,
                               1e2 * r.run->summary["error_m"].mean);
      if (!r.own() || at.minCoeff() <= 0.0) continue;
      panel.curves.push_back({name_of(r), look_of(r), {at}, true});
      bytes.push_back(at.x());
      errors.push_back(at.y());
    }
    panels.push_back(std::move(panel));
  }
  std::vector<std::string> drawn;
  if (bytes.empty()) return drawn;
  const auto axis = [](const char* label, const std::vector<double>& sample) {
    const auto [low, high] = std::ranges::minmax(sample);
    return report::logarithmic_axis(label, low, high);
  };
  for (LinePanel& panel : panels) {
    if (panel.curves.empty()) continue;
    panel.x = axis("map in use [kB]", bytes);
    panel.y = axis("mean error [cm]", errors);
    drawn.push_back(to_svg(panel, 560.0, 210.0));
  }
  return drawn;
}

bool has_reference(const Evaluation& e) { return !everything(e, "error_m").empty(); }

constexpr const char* kReading =
    "Box: middle half of the scans with the median; whiskers: to the last scan within 1.5 boxes; "
    "dots: beyond; diamond: mean. Baselines with equal numbers of points are below their "
    "configuration, each with its own mark for the mean: circle random, square voxel, triangle "
    "radius.";

}  // namespace

std::string alignment_figures(const Evaluation& e) {
  std::string html =
      "<p>T<sub>align</sub> is the time of scan matching alone, after the map is in memory (Sec. "
      "3.3). It depends on the computer; compare configurations, not times.</p>\n";
  std::string figures =
      report::figure(boxes(e, "T_align", "T_align [ms]", "align_ms", true),
                     fmt::format("Fig. 10 a. Alignment time. {}", kReading), "fig10a-align");
  figures += report::figure(lines(e, "T_align along the route", "T_align [ms]", "align_ms", true),
                            "Fig. 10 b. Alignment time along the route.", "fig10b-align");
  return html + report::side_by_side(figures);
}

std::string fitness_figures(const Evaluation& e) {
  std::string figures =
      report::figure(boxes(e, "S_fitness", "S_fitness (Eq. 12), more is better", "fitness", false),
                     fmt::format("Fig. 11. Scan-matching fitness of tracked scans. {}", kReading),
                     "fig11-fitness");
  figures += report::figure(
      boxes(e, "Coverage", "scan points with a voxel [%], more is better", "coverage", false),
      "Coverage: share of a scan’s points that have a voxel to be compared with.", "coverage");
  figures += report::figure(boxes(e, "NVTL", "NVTL, more is better", "nvtl", false),
                            "NVTL: mean over the matched points of the best voxel’s likelihood. It "
                            "also ignores missing parts of the map.",
                            "nvtl");
  if (has_reference(e)) {
    figures +=
        report::figure(boxes(e, "Position error", "error [cm], less is better", "error_m", true),
                       "Error against the reference, on the same scans.", "error-beside-fitness");
  }
  return "<p><strong>Fitness alone rewards deleting map.</strong> A scan point with no voxel near "
         "it scores 0 in S<sub>fitness</sub> (Eq. 12), which is more than a badly matched point "
         "gets. Coverage, NVTL and error beside it show what was lost.</p>\n" +
         report::side_by_side(figures);
}

std::string lcp_figures(const Evaluation& e) {
  std::string figures =
      report::figure(boxes(e, "LCP of scans", "LCP [10⁻⁶], more is better", "lcp", true),
                     fmt::format("Fig. 12 a. LCP of tracked scans. {}", kReading), "fig12a-lcp");
  figures += report::figure(region_dots(e, "LCP of regions", "LCP [10⁻⁶], more is better", "lcp"),
                            "Fig. 12 b. LCP of each local region: mean over the scans that were "
                            "matched in it. Vertical line: mean of the regions.",
                            "fig12b-lcp");
  return "<p>LCP is S<sub>fitness</sub> by the number of map points (Eq. 13). Any reduction of the "
         "map raises a positive LCP and lowers a negative one, so baselines of equal size have "
         "about the same LCP. It reflects the size of a map more than the choice of its "
         "points.</p>\n" +
         report::side_by_side(figures);
}

std::string error_figures(const Evaluation& e) {
  if (!has_reference(e)) return "<p>No scan has both a reference and an estimate.</p>\n";
  std::string html =
      "<p>Errors against the reference of tracked scans, without aligning trajectories. A gap in a "
      "curve is a scan that was not tracked or has no reference.</p>\n";
  std::string figures =
      report::figure(lines(e, "Position error along the route", "error [cm]", "error_m", true),
                     "Error along the route.", "error-way");
  const Axis x = report::axis_over("error [cm]", everything(e, "error_m"), true, 8);
  figures += report::figure(cumulative_of_configs(e, x),
                            "Share of tracked scans with an error below x. Further left is better.",
                            "error-cumulative");
  if (const auto panels = errors_by_bytes(e); !panels.empty()) {
    figures += report::figure(
        panels,
        "Mean error over the mean size of the maps in use. Further down and left is better.",
        "error-bytes");
  }
  std::string against;
  if (const auto panels = cumulative_of_baselines(e, x); !panels.empty()) {
    against = report::figure(
        panels, "Each configuration against the same number of points, chosen otherwise.",
        "error-baselines");
  }
  figures += report::figure(boxes(e, "Position error", "error [cm]", "error_m", true),
                            fmt::format("Position error. {}", kReading), "error-position");
  figures += report::figure(boxes(e, "Rotation error", "error [°]", "error_deg", true),
                            "Rotation error.", "error-rotation");
  return html + report::side_by_side(figures) + against;
}

std::string motion_figures(const Evaluation& e) {
  std::string figures;
  if (!everything(e, "prediction_m", false).empty()) {
    figures += report::figure(
        lines(e, "Error of the prediction along the route", "error [cm]", "prediction_m", true),
        "Distance between the predicted position and the reference, before the scan was matched.",
        "prediction-way");
  }
  if (!everything(e, "correction_m").empty()) {
    figures += report::figure(
        boxes(e, "Correction by matching", "correction [cm]", "correction_m", true),
        fmt::format("How far matching moved the prediction. {}", kReading), "correction");
  }
  if (figures.empty()) return "<p>No scan was matched near a prediction.</p>\n";
  return "<p>The prediction is where earlier scans, odometry and IMU put the sensor. An IMU or "
         "odometry makes it better; what matters is the error after matching.</p>\n" +
         report::side_by_side(figures);
}

std::string risk_figures(const Evaluation& e) {
  const std::vector<double> risks = everything(e, "risk", false);
  if (risks.empty()) return "<p>No scan has a pose.</p>\n";
  return "<p>The integrity risk is the localizer’s own estimate of the probability that a pose is "
         "beyond the alert limit. The localizer knows no reference: compare the risk with the "
         "error.</p>\n" +
         report::figure(
             lines(e, "Integrity risk along the route", report::risk_axis(risks), "risk"),
             "Integrity risk of every scan that has a pose, tracked or not. A gap in a curve is a "
             "scan without a pose.",
             "risk-way");
}

}  // namespace vantage::page
