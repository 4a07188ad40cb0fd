#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "evaluate/page/maps.hpp"
#include "evaluate/page/samples.hpp"
#include "evaluate/page/tables.hpp"
#include "report/assets.hpp"
#include "report/html.hpp"
#include "report/plan.hpp"
#include "report/points.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage::page {
namespace {

using Json = nlohmann::ordered_json;

// Limits of the page's size: each point takes 8 bytes.
constexpr std::size_t kMapPoints = 280000, kSpecimenPoints = 280000, kMostOfOneSpecimen = 120000;
constexpr std::size_t kWayPoints = 60000, kViewpoints = 3000;
constexpr double kBordersAround = 60.0;  // [m] from a route

Json numbers(const Point& p) { return {p.x(), p.y(), p.z()}; }

/// @param origin  is subtracted, so that a browser's single precision is enough
Json cloud(PointsView points, const Point& origin) {
  const auto q = report::quantized(points, bounds_of(points));
  return {{"count", q.points.size()},
          {"origin", numbers(q.points.empty() ? Point::Zero() : Point(q.origin - origin))},
          {"step", numbers(q.step)},
          {"data", report::base64(q)}};
}

PointCloud some_of(const PointCloud& points, std::size_t most) {
  const std::size_t step = std::max<std::size_t>(1, (points.size() + most - 1) / most);
  PointCloud some;
  for (std::size_t i = 0; i < points.size(); i += step) some.push_back(points[i]);
  return some;
}

PointCloud positions_of(const io::Trajectory& trajectory) {
  PointCloud positions;
  for (const auto& moment : trajectory) positions.push_back(moment.pose.translation);
  return positions;
}

PointCloud positions_of(const Run& run) {
  PointCloud positions;
  for (const RunScan& scan : run.scans) {
    if (is_tracked(scan)) positions.push_back(scan.report.T_map_scan.translation);
  }
  return positions;
}

/// Line ends in plan view, raised to the height of the nearest of some places.
PointCloud raised(const std::vector<Eigen::Vector2d>& ends, const PointCloud& places) {
  PointCloud lines;
  for (const Eigen::Vector2d& p : ends) {
    double nearest = std::numeric_limits<double>::infinity(), z = 0.0;
    for (const Point& place : places) {
      const double d = (place.head<2>() - p).squaredNorm();
      if (d >= nearest) continue;
      nearest = d;
      z = place.z();
    }
    lines.emplace_back(p.x(), p.y(), z);
  }
  return lines;
}

Json config_json(const Evaluation& e, std::size_t number, const Point& origin,
                 const PointCloud& places, std::size_t specimen_points, std::size_t way_points) {
  const EvaluatedConfig& config = e.configs[number];
  Json json{{"name", config.name}};
  std::vector<Eigen::Vector2d> borders;
  for (const Region& region : config.index.partition.regions()) {
    if (config.index.partition.size() == 1) break;
    const bool near = std::any_of(places.begin(), places.end(), [&](const Point& p) {
      return distance(region.footprint, Eigen::Vector2d(p.head<2>())) < kBordersAround;
    });
    if (!near) continue;
    const auto ends = report::outline_lines(region.footprint);
    borders.insert(borders.end(), ends.begin(), ends.end());
  }
  json["borders"] = cloud(raised(borders, places), origin);
  if (config.specimen) {
    const Specimen& specimen = *config.specimen;
    const Region& region = config.index.partition[specimen.region];
    json["specimen"] = cloud(report::thinned(specimen.points, specimen_points), origin);
    json["specimen"]["of"] = specimen.points.size();
    json["region"] = region.label;
    if (config.index.partition.size() > 1) {
      json["border"] = cloud(raised(report::outline_lines(region.footprint), places), origin);
    }
    json["viewpoints"] = cloud(some_of(specimen.viewpoints, kViewpoints), origin);
  }
  json["runs"] = Json::array();
  for (std::size_t route = 0; route < config.routes.size(); ++route) {
    json["runs"].push_back(
        cloud(some_of(positions_of(config.routes[route].run), way_points), origin));
  }
  return json;
}

/// JSON as the content of a script element, which no markup in it can end.
std::string in_script(const Json& json) {
  std::string text;
  for (const char c : json_line(json)) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

}  // namespace

View3d view_3d(const Evaluation& e) {
  std::size_t specimens = 0, runs = e.routes.size();
  Bounds3 all = bounds_of(e.map);
  PointCloud places;
  for (const Route& route : e.routes) {
    const PointCloud positions = positions_of(route.reference);
    for (const Point& p : positions) all.extend(p);
    const PointCloud some = some_of(positions, 300);
    places.insert(places.end(), some.begin(), some.end());
  }
  for (const EvaluatedConfig& config : e.configs) {
    specimens += config.specimen ? 1 : 0;
    runs += config.routes.size();
  }
  if (all.empty()) return {"<p>There is nothing to show: no map and no trajectory.</p>\n", ""};
  const Point origin = (0.5 * (all.min + all.max)).array().round();
  const std::size_t specimen_points =
      std::min(kMostOfOneSpecimen, kSpecimenPoints / std::max<std::size_t>(1, specimens));
  const std::size_t way_points =
      std::max<std::size_t>(100, kWayPoints / std::max<std::size_t>(1, runs));

  Json json{{"origin", numbers(origin)}};
  json["map"] = cloud(report::thinned(e.map, kMapPoints), origin);
  json["map"]["of"] = e.map.size();
  const report::Heights heights = report::heights_of(e.map);
  json["heights"] = {heights.low - origin.z(), heights.high - origin.z()};
  json["routes"] = Json::array();
  for (const Route& route : e.routes) {
    json["routes"].push_back(
        {{"name", route.name},
         {"reference", cloud(some_of(positions_of(route.reference), way_points), origin)}});
  }
  json["configs"] = Json::array();
  for (std::size_t c = 0; c < e.configs.size(); ++c) {
    json["configs"].push_back(config_json(e, c, origin, places, specimen_points, way_points));
  }
  View3d view;
  view.body =
      "<p class=\"no-print\">Drag to rotate. Zoom with the wheel or two fingers. Move with the "
      "right button or two fingers. The map is thinned evenly for this page, the same way each "
      "time.</p>\n"
      "<figure><div class=\"panels single\"><div class=\"panel\" data-file=\"map-3d\">\n"
      "<div id=\"view3d\"><div class=\"controls\"></div><p class=\"none\">This view needs scripts "
      "and WebGL.</p></div>\n"
      "<p class=\"tools\"><button type=\"button\" data-act=\"png\">Save "
      "PNG</button></p></div></div></figure>\n";
  view.scripts = fmt::format(
      "<script type=\"application/json\" id=\"view3d-data\">{}</script>\n"
      "<script>/* three.js r111 and its OrbitControls, MIT licence\n"
      "Copyright 2010-2019 three.js authors\n{}*/\n{}</script>\n<script>{}</script>\n"
      "<script>{}{}</script>\n",
      in_script(json), report::kMitLicence, report::asset("three.min.js"),
      report::asset("OrbitControls.js"), report::asset("heights.js"), report::asset("view3d.js"));
  return view;
}

}  // namespace vantage::page
