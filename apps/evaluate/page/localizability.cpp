#include "localizability/localizability.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "evaluate/page/error_classes.hpp"
#include "evaluate/page/maps.hpp"
#include "report/html.hpp"
#include "report/plan.hpp"
#include "terminal/counts.hpp"

namespace vantage::page {
namespace {

using report::PlanWindow;

std::string site_tip(const Site& site, const std::string& region) {
  std::string text = "site in " + region;
  if (const auto& p = site.precision) {
    text += fmt::format("\nexpected error {:.1f} cm", 100.0 * p->expected_error);
    text += fmt::format("\nsigma {:.1f} cm along {}° from the map's y axis, {:.1f} cm across",
                        100.0 * p->sigma_weak, std::lround(weak_bearing(*p)) % 180,
                        100.0 * p->sigma_strong);
    text += fmt::format("\nbasin {:g} m", p->basin);
  } else {
    text += "\na scan from here matches nothing";
  }
  for (const AlikePlace& place : site.alike) {
    text += fmt::format("\nalike place {:.1f} m away, likeness {:.2f}", distance(site, place),
                        place.likeness);
  }
  return text;
}

/// A line along the weak direction, longer the weaker it is.
std::string weak_tick(const SitePrecision& p, double x, double y, double radius) {
  constexpr double kMostRatio = 6.0;
  const double ratio =
      p.sigma_weak < kMostRatio * p.sigma_strong ? p.sigma_weak / p.sigma_strong : kMostRatio;
  const double half = radius * (1.5 * ratio - 0.5);
  const double dx = half * std::cos(p.weak_direction), dy = -half * std::sin(p.weak_direction);
  return fmt::format("<path class=\"weak\" d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\"/>\n", x - dx, y - dy,
                     x + dx, y + dy);
}

std::string sites_svg(const Evaluation& e, const EvaluatedConfig& config,
                      const PlanWindow& window) {
  const Atlas& atlas = *config.atlas;
  const double limit =
      config.routes.empty() ? AlertLimit{}.metres : config.routes.front().run.alert_limit.metres;
  const Localizability all = localizability_of(atlas, limit);
  std::string note =
      fmt::format("{} for {}", cli::counted(all.sites, "site"), atlas.matcher.plugin);
  if (all.expected_error.count > 0) {
    note += fmt::format(", median {:.1f} cm", 100.0 * all.expected_error.median);
  }
  note += fmt::format(", {} above {:g} m", cli::grouped(all.beyond_limit), limit);
  std::string svg = report::plan_opening(config.name, note, window);
  if (!e.map.empty()) svg += "<use class=\"ground\" href=\"#map-of-sites\"/>\n";
  for (const Route& route : e.routes) {
    std::string points;
    for (const auto& moment : route.reference) {
      points += report::polyline_point(moment.pose.translation.head<2>(), window);
    }
    svg += fmt::format("<polyline class=\"reference\" points=\"{}\"/>\n", points);
  }
  // A tenth of the distance between sites, so that crowded ones do not cover each other.
  const double area = window.width * window.height();
  const double radius = std::clamp(
      0.1 * std::sqrt(area / static_cast<double>(std::max<std::size_t>(all.sites, 1))), 1.8, 4.5);
  std::string links, ticks, dots;
  for (const Site& site : atlas.sites) {
    const double x = window.x(site.position.x()), y = window.y(site.position.y());
    for (const AlikePlace& place : site.alike) {
      const Point& to = place.T_map_scan.translation;
      links += fmt::format("<path class=\"alike\" d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\"/>\n", x, y,
                           window.x(to.x()), window.y(to.y()));
    }
    const std::string tip = site_tip(site, config.index.partition[site.region].label);
    if (!site.precision) {
      dots += report::plan_cross(site.position.head<2>(), window, tip);
      continue;
    }
    ticks += weak_tick(*site.precision, x, y, radius);
    dots += report::plan_dot(
        site.position.head<2>(), window,
        fmt::format("site e{}", error_class_of(100.0 * site.precision->expected_error)), radius,
        tip);
  }
  return svg + links + ticks + dots + report::scale_bar(window) + report::plan_end();
}

std::string sites_legend() {
  return "<p class=\"legend\">" + error_class_legend() +
         "<span><i class=\"cross\">✕</i>a scan matches nothing</span> <span><i "
         "class=\"tick\"></i>weak direction</span> <span><i class=\"dashed\"></i>to an alike "
         "place</span></p>\n";
}

}  // namespace

Result<std::string> localizability(const Evaluation& e) {
  report::Extent extent;
  for (const EvaluatedConfig& config : e.configs) {
    if (!config.atlas) continue;
    for (const Site& site : config.atlas->sites) extent.see(site.position.head<2>());
  }
  if (extent.empty()) return std::string();
  for (const Route& route : e.routes) {
    for (const auto& moment : route.reference) extent.see(moment.pose.translation.head<2>());
  }
  const PlanWindow window = report::window_of_drive(extent);
  std::string html =
      "<p>How well a sensor can be localized, wherever it stands: measured with virtual scans by "
      "<code>vantage assess</code>, without any drive.</p>\n" +
      sites_legend();
  if (!e.map.empty()) {
    VANTAGE_TRY(const std::string png, report::density_picture(e.map, window));
    html += report::shared_picture("map-of-sites", window, png);
  }
  std::vector<std::string> panels;
  std::string without;
  for (const EvaluatedConfig& config : e.configs) {
    if (config.atlas) {
      panels.push_back(sites_svg(e, config, window));
    } else {
      without += (without.empty() ? "" : ", ") + report::escaped(config.name);
    }
  }
  html += report::figure(
      panels,
      "Sites of the bundle's atlas, coloured by the expected horizontal error of a scan there. The "
      "line through a site is the direction of which least is known; it is longer the weaker that "
      "direction is. A dashed line leads to a place that a scan of the site fits as well, or "
      "nearly. Grey line: reference of the routes.",
      "localizability");
  return without.empty() ? html
                         : html + "<p>Bundles without an atlas: " + without + "; " +
                               kHowToGetAnAtlas + ".</p>\n";
}

}  // namespace vantage::page
