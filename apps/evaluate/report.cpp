#include "evaluate/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/table.hpp"

namespace vantage {
namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --line: #8888; --soft: #8883; --accent: #2a78d6; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .5rem; font-size: .85rem; text-align: right; border-bottom: 1px solid var(--soft); }
th:first-child, td:first-child { text-align: left; }
.wide { overflow-x: auto; }
svg { width: 100%; height: auto; max-height: 36rem; }
svg text { fill: currentColor; font: 11px system-ui, sans-serif; }
.parts { stroke: none !important; }
.region { fill-opacity: 0.15; stroke: var(--line); vector-effect: non-scaling-stroke; }
.reference { fill: none; stroke: var(--line); stroke-width: 3; vector-effect: non-scaling-stroke; }
.legend { display: flex; gap: 1rem; flex-wrap: wrap; font-size: .9rem; }
.legend i { display: inline-block; width: .8rem; height: .8rem; margin-right: .3rem; border-radius: 50%; }
)";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '&': out += "&amp;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

struct ErrorClass {
  double below_m;
  const char *colour, *label;
};
// Ordered from good to bad; readable by people who do not tell red from green.
constexpr std::array kErrorClasses{
    ErrorClass{0.02, "#1b7837", "below 2 cm"}, ErrorClass{0.05, "#5aae61", "2-5 cm"},
    ErrorClass{0.10, "#e6a817", "5-10 cm"}, ErrorClass{0.50, "#e6550d", "10-50 cm"},
    ErrorClass{std::numeric_limits<double>::infinity(), "#a50f15", "50 cm and more"}};

const char* colour_of(const RunScan& scan) {
  if (!scan.error) return "var(--accent)";
  for (const ErrorClass& c : kErrorClasses) {
    if (scan.error->metres < c.below_m) return c.colour;
  }
  return kErrorClasses.back().colour;
}

/// The closed lines around a footprint's convex parts.
std::vector<std::vector<Eigen::Vector2d>> outlines(const HalfOpenBox& box) {
  return {{box.min, {box.max.x(), box.min.y()}, box.max, {box.min.x(), box.max.y()}}};
}
std::vector<std::vector<Eigen::Vector2d>> outlines(const ConvexPolygon& polygon) {
  return {polygon.corners};
}
std::vector<std::vector<Eigen::Vector2d>> outlines(const BoxUnion& shape) {
  std::vector<std::vector<Eigen::Vector2d>> all;
  for (const HalfOpenBox& box : shape.boxes) all.push_back(outlines(box).front());
  return all;
}

/// The trajectory from above; y points up, so the picture's y is turned round.
std::string map_svg(const Run& run, const io::Trajectory& reference) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  const auto see = [&](const Eigen::Vector3d& p) {
    low = low.cwiseMin(p.head<2>());
    high = high.cwiseMax(p.head<2>());
  };
  for (const auto& moment : reference) see(moment.pose.translation);
  for (const RunScan& scan : run.scans) see(scan.report.T_map_scan.translation);
  const double border = 0.08 * std::max((high - low).maxCoeff(), 10.0);
  low.array() -= border;
  high.array() += border;
  const Eigen::Vector2d size = high - low;
  const double dot = size.maxCoeff() / 180.0;
  const auto x = [&](const auto& p) { return p.x() - low.x(); };
  const auto y = [&](const auto& p) { return high.y() - p.y(); };

  std::string svg =
      fmt::format("<svg viewBox=\"0 0 {:.2f} {:.2f}\" role=\"img\">\n", size.x(), size.y());
  for (std::uint32_t id = 0; id < run.index.partition.size(); ++id) {
    const Region& region = run.index.partition[RegionId{id}];
    const auto parts =
        std::visit([](const auto& shape) { return outlines(shape); }, region.footprint);
    std::string path;
    for (const auto& outline : parts) {
      Eigen::Vector2d least = outline.front(), most = outline.front();
      for (const Eigen::Vector2d& c : outline) {
        least = least.cwiseMin(c);
        most = most.cwiseMax(c);
      }
      if ((most.array() < low.array()).any() || (least.array() > high.array()).any()) continue;
      for (std::size_t i = 0; i < outline.size(); ++i) {
        path += fmt::format("{}{:.2f} {:.2f}", i == 0 ? 'M' : 'L', x(outline[i]), y(outline[i]));
      }
      path += 'Z';
    }
    if (path.empty()) continue;
    // Neighbours in the list get far-apart hues. The boxes of a union show no lines between them.
    svg += fmt::format(
        "<path class=\"{}\" fill=\"hsl({} 60% 50%)\" d=\"{}\"><title>{}</title></path>\n",
        parts.size() == 1 ? "region" : "region parts", 137U * id % 360U, path,
        escaped(region.label));
  }
  svg += "<polyline class=\"reference\" points=\"";
  for (const auto& m : reference)
    svg += fmt::format("{:.2f},{:.2f} ", x(m.pose.translation), y(m.pose.translation));
  svg += "\"/>\n";
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const ScanReport& r = run.scans[i].report;
    const auto& p = r.T_map_scan.translation;
    if (r.tracking == Tracking::lost) {
      svg += fmt::format(
          "<path d=\"M{0:.2f} {1:.2f}l{2:.2f} {2:.2f}m0 {3:.2f}l{3:.2f} {2:.2f}\" "
          "stroke=\"#a50f15\" "
          "stroke-width=\"{4:.2f}\"><title>scan {5}: lost, {6}</title></path>\n",
          x(p) - dot, y(p) - dot, 2 * dot, -2 * dot, dot / 2, i, escaped(r.reason));
      continue;
    }
    svg += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" fill=\"{}\"", x(p), y(p),
                       dot, colour_of(run.scans[i]));
    if (r.switched) svg += fmt::format(" stroke=\"currentColor\" stroke-width=\"{:.2f}\"", dot / 2);
    svg += fmt::format(
        "><title>scan {}, region {}{}</title></circle>\n", i,
        escaped(run.index.partition[r.region].label),
        run.scans[i].error ? fmt::format(", {:.1f} cm", 100 * run.scans[i].error->metres) : "");
  }
  return svg + "</svg>\n";
}

/// Error of every scan [cm] over the scans.
std::string error_svg(const std::vector<EvaluatedRun>& runs) {
  constexpr double kWidth = 900, kHeight = 240, kLeft = 45, kBottom = 25;
  constexpr std::array kColours{"#2a78d6", "#e6550d", "#1b7837", "#8e44ad", "#e6a817", "#555555"};
  double top = 0;
  std::size_t scans = 2;
  for (const EvaluatedRun& r : runs) {
    top = std::max(top, 100.0 * r.summary.error_m.max);
    scans = std::max(scans, r.run.scans.size());
  }
  top = std::max(top * 1.05, 1.0);
  const auto x = [&](std::size_t i) {
    return kLeft + (kWidth - kLeft) * static_cast<double>(i) / static_cast<double>(scans - 1);
  };
  const auto y = [&](double cm) { return (kHeight - kBottom) * (1.0 - cm / top) + 5; };

  std::string svg = fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\">\n", kWidth, kHeight + 10);
  for (int tick = 0; tick <= 4; ++tick) {
    const double cm = top * tick / 4;
    svg += fmt::format(
        "<line class=\"region\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>"
        "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.1f}</text>\n",
        kLeft, kWidth, y(cm), kLeft - 5, y(cm) + 4, cm);
  }
  for (std::size_t k = 0; k < runs.size(); ++k) {
    svg += fmt::format("<polyline fill=\"none\" stroke-width=\"1.5\" stroke=\"{}\" points=\"",
                       kColours[k % kColours.size()]);
    for (std::size_t i = 0; i < runs[k].run.scans.size(); ++i) {
      const RunScan& scan = runs[k].run.scans[i];
      if (scan.error && scan.report.tracking == Tracking::tracked) {
        svg += fmt::format("{:.1f},{:.1f} ", x(i), y(100 * scan.error->metres));
      }
    }
    svg += "\"/>\n";
  }
  svg += fmt::format("<text x=\"{}\" y=\"{}\">scan</text></svg>\n", kWidth / 2, kHeight + 5);
  svg += "<p class=\"legend\">";
  for (std::size_t k = 0; k < runs.size(); ++k) {
    svg += fmt::format("<span><i style=\"background:{}\"></i>{}</span>",
                       kColours[k % kColours.size()], escaped(runs[k].name));
  }
  return svg + "</p>\n";
}

}  // namespace

double EvaluatedRun::reduction() const {
  return run.index.map_points == 0
             ? 0.0
             : 1.0 - region_points.mean / static_cast<double>(run.index.map_points);
}

std::vector<std::vector<std::string>> comparison(const std::vector<EvaluatedRun>& runs) {
  std::vector<std::vector<std::string>> rows{{"config", "regions", "points/region", "min", "max",
                                              "reduction", "MB", "error mean [cm]", "p95",
                                              "error [deg]", "lost", "switches", "T_align [ms]",
                                              "fitness", "NVTL", "coverage", "LCP x 1e6"}};
  const auto whole = [](double x) { return cli::grouped(static_cast<std::uint64_t>(x + 0.5)); };
  for (const EvaluatedRun& r : runs) {
    const RunSummary& s = r.summary;
    rows.push_back({r.name, cli::grouped(r.run.index.partition.size()), whole(r.region_points.mean),
                    whole(r.region_points.min), whole(r.region_points.max),
                    fmt::format("{:.1f} %", 100.0 * r.reduction()),
                    fmt::format("{:.1f}", static_cast<double>(r.bundle_bytes) / 1e6),
                    fmt::format("{:.2f}", 100.0 * s.error_m.mean),
                    fmt::format("{:.2f}", 100.0 * s.error_m.p95),
                    fmt::format("{:.3f}", s.error_deg.mean), fmt::format("{}/{}", s.lost, s.scans),
                    std::to_string(s.switches), fmt::format("{:.1f}", s.align_ms.mean),
                    fmt::format("{:.3f}", s.fitness.mean), fmt::format("{:.3f}", s.nvtl.mean),
                    fmt::format("{:.3f}", s.coverage.mean),
                    fmt::format("{:.3f}", 1e6 * s.lcp.mean)});
  }
  return rows;
}

std::string to_html(const std::vector<EvaluatedRun>& runs, const io::Trajectory& reference) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width\">\n<title>Vantage "
      "evaluation</title>\n<style>{}</style></head><body>\n"
      "<h1>Evaluation</h1>\n",
      kStyle);
  html += "<div class=\"wide\"><table>\n";
  const auto rows = comparison(runs);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    html += "<tr>";
    for (const std::string& cell : rows[i]) {
      const char* tag = i == 0 ? "th" : "td";
      html += fmt::format("<{0}>{1}</{0}>", tag, escaped(cell));
    }
    html += "</tr>\n";
  }
  html +=
      "</table></div>\n<p>Errors, fitness (S<sub>fitness</sub>, Eq. 12), NVTL, coverage and LCP "
      "(Eq. 13) are "
      "means over tracked scans, without aligning the trajectories. Fitness alone rewards a map "
      "with holes: "
      "a scan point without a voxel scores 0, a badly matched one below 0. Read it with coverage "
      "and "
      "error.</p>\n<h2>Error of every scan [cm]</h2>\n";
  html += error_svg(runs);
  for (const EvaluatedRun& r : runs) {
    html += fmt::format("<h2>{}</h2>\n<p>{} scans ({}), {} lost, {} region switches.</p>\n",
                        escaped(r.name), r.summary.scans, escaped(r.run.stamp_rule), r.summary.lost,
                        r.summary.switches);
    html += map_svg(r.run, reference);
    html += "<p class=\"legend\">";
    for (const ErrorClass& c : kErrorClasses) {
      html += fmt::format("<span><i style=\"background:{}\"></i>{}</span>", c.colour, c.label);
    }
    html +=
        "<span>ringed: the map was switched; cross: lost; grey: reference and region "
        "borders</span></p>\n";
  }
  return html + "</body></html>\n";
}

}  // namespace vantage
