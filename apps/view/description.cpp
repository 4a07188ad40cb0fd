#include "view/description.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "terminal/table.hpp"
#include "view/leverage.hpp"

namespace vantage::view {
namespace {

std::string label_of(const Scene& scene, const Controls& controls) {
  return controls.region ? scene.index().partition[*controls.region].label : std::string();
}

std::string legend(const Drawing& drawing, const Controls& controls, const Scales& scales,
                   const Scene& scene) {
  switch (controls.coloring) {
    case Coloring::height:
      return fmt::format("height, {:.1f} m (blue) to {:.1f} m (yellow)",
                         scales.height.low + scene.origin().z(),
                         scales.height.high + scene.origin().z());
    case Coloring::region: return "the region that a point is in, light is high";
    case Coloring::views: {
      const auto most = std::max_element(drawing.views.begin(), drawing.views.end());
      return fmt::format(
          "{} a point, 1 (dark) to {:.0f} (light){}",
          scene.bundle()->has_views() ? "viewpoints that see" : "region maps that hold",
          scales.views.high,
          *most > scales.views.high ? fmt::format(" and more, {} at most", cli::grouped(*most))
                                    : std::string());
    }
    case Coloring::contribution: {
      const double whole =
          kFreedom * static_cast<double>(scene.contributions()->scans(controls.region));
      const auto percent = [&](double logarithm) {
        return 100.0 * std::pow(10.0, logarithm) / whole;
      };
      return fmt::format(
          "what an element has of all that fixes the poses, {:.2g} % and less (dark) to {:.2g} % "
          "(light)",
          percent(scales.contribution.low), percent(scales.contribution.high));
    }
    case Coloring::localizability:
      return fmt::format(
          "expected error at the nearest site, {:g} m (blue) to {:g} m and more, or no match "
          "(red)\n"
          "sites      {} of the atlas for {}; white line: weak direction, longer if weaker; "
          "violet: alike places",
          kLeastError, kLargestError, cli::grouped(scene.atlas()->sites.size()),
          scene.atlas()->matcher.plugin);
  }
  return {};
}

/// "; left out: 3 without a pose, 2 in no region with a map", or nothing.
std::string left_out(const Contributions& found) {
  std::string text;
  const auto add = [&](std::size_t scans, const char* why) {
    if (scans == 0) return;
    text += fmt::format("{} {} {}", text.empty() ? "; left out:" : ",", cli::grouped(scans), why);
  };
  add(found.without_pose, "without a pose");
  add(found.outside, "in no region with a map");
  add(found.loose, "that the map does not fix");
  return text;
}

std::string about_points(const Scene& scene, const Drawing& drawing, std::size_t max_points) {
  std::string text = fmt::format(
      "points     {} drawn of a map of {}{}\n", cli::grouped(drawing.points.size()),
      cli::grouped(scene.total_points()),
      drawing.thinned ? fmt::format("; thinned to --max-points {}", cli::grouped(max_points))
                      : std::string());
  if (scene.dropped_points() > 0) {
    text += fmt::format("dropped    {} with NaN or infinite coordinates\n",
                        cli::counted(scene.dropped_points(), "point"));
  }
  return text;
}

std::string about_elements(const Contributions& found, const Drawing& drawing,
                           const std::optional<RegionId>& region, std::size_t max_points) {
  const auto elements = found.elements(region);
  const double percent = 100.0 / (kFreedom * static_cast<double>(found.scans(region)));
  return fmt::format(
      "scans      {} matched by {} in {}{}\n"
      "elements   {} with points of these scans{}\n"
      "strongest  10 % of them do {:.0f} % of what fixes the poses, 50 % do {:.0f} %\n"
      "not drawn  elements that no scan has a point in, which do {:.1f} %\n",
      cli::grouped(found.scans(region)), found.matcher,
      region ? "this region" : cli::counted(found.parts.size(), "region"), left_out(found),
      cli::grouped(elements.size()),
      drawing.thinned ? fmt::format("; the {} strongest are drawn", cli::grouped(max_points)) : "",
      percent * strongest(elements, 0.1), percent * strongest(elements, 0.5),
      percent * found.elsewhere(region));
}

/// Shares are those of all that fixes the poses, 0 .. 1.
nlohmann::ordered_json to_json(const Contributions& found, const std::optional<RegionId>& region) {
  const auto elements = found.elements(region);
  const double all = kFreedom * static_cast<double>(found.scans(region));
  std::vector<double> shares;
  for (const Contribution& element : elements) shares.push_back(element.leverage / all);
  std::ranges::sort(shares);
  const auto quantile = [&](double share) {
    return shares[static_cast<std::size_t>(share * static_cast<double>(shares.size() - 1))];
  };
  nlohmann::ordered_json json{{"matcher", found.matcher},
                              {"scans", found.scans(region)},
                              {"scans_without_pose", found.without_pose},
                              {"scans_outside", found.outside},
                              {"scans_not_fixed", found.loose},
                              {"regions", region ? std::size_t{1} : found.parts.size()},
                              {"elements", elements.size()},
                              {"leverage", strongest(elements, 1.0) + found.elsewhere(region)},
                              {"share_not_drawn", found.elsewhere(region) / all}};
  for (const auto& [name, part] : {std::pair("1%", 0.01), {"10%", 0.1}, {"50%", 0.5}}) {
    json["share_of_strongest"][name] = strongest(elements, part) / all;
  }
  for (const auto& [name, share] :
       {std::pair("p50", 0.5), {"p90", 0.9}, {"p99", 0.99}, {"max", 1.0}}) {
    json["share_of_one"][name] = quantile(share);
  }
  return json;
}

}  // namespace

std::string description(const Scene& scene, const Drawing& drawing, const Controls& controls,
                        const Scales& scales, std::size_t max_points) {
  const Point& o = scene.origin();
  std::string text =
      fmt::format("shown      {}{}\n", scene.name(),
                  controls.region ? ", region '" + label_of(scene, controls) + "'" : "");
  text += scene.contributions()
              ? about_elements(*scene.contributions(), drawing, controls.region, max_points)
              : about_points(scene, drawing, max_points);
  text += fmt::format("origin     drawn around x {:.0f}, y {:.0f}, z {:.0f} m of the map\n", o.x(),
                      o.y(), o.z());
  return text + "colour     " + legend(drawing, controls, scales, scene) + "\n";
}

nlohmann::ordered_json to_json(const Scene& scene, const Drawing& drawing, const Controls& controls,
                               const Scales& scales) {
  const Point& o = scene.origin();
  nlohmann::ordered_json json{{"shown", scene.name()},
                              {"map_points", scene.total_points()},
                              {"dropped_points", scene.dropped_points()},
                              {"drawn_points", drawing.points.size()},
                              {"thinned", drawing.thinned},
                              {"origin", {o.x(), o.y(), o.z()}},
                              {"color", to_string(controls.coloring)},
                              {"height", {scales.height.low + o.z(), scales.height.high + o.z()}}};
  if (scene.bundle()) json["regions"] = scene.index().partition.size();
  if (controls.region) {
    json["region"] = label_of(scene, controls);
    json["viewpoints"] = drawing.viewpoints.size();
  }
  if (controls.coloring == Coloring::localizability) {
    json["sites"] = scene.atlas()->sites.size();
    json["expected_error"] = {kLeastError, kLargestError};
  }
  if (scene.contributions()) {
    json["contribution"] = to_json(*scene.contributions(), controls.region);
  }
  if (!drawing.views.empty()) {
    json["views"] = *std::max_element(drawing.views.begin(), drawing.views.end());
  }
  return json;
}

}  // namespace vantage::view
