#include <fmt/format.h>

#include <array>

#include "evaluate/page/tables.hpp"
#include "report/html.hpp"
#include "terminal/counts.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage::page {
namespace {

using report::escaped;

struct Definition {
  const char *name, *text;  ///< HTML
};

constexpr std::array kDefinitions{
    Definition{"Region map",
               "the points of the wide-area map that can be seen from the virtual "
               "viewpoints of a local region (Eqs. 1–10); the map of the region of the last "
               "estimate is matched against (Eq. 11)"},
    Definition{
        "Relative error",
        "translation and angle of (true motion)⁻¹ · (estimated motion), from each scan "
        "to the next, and to the first scan at least 10 m on along the reference; both tracked"},
    Definition{"Tracked, uncertain, lost",
               "tracked: the pose comes from matching and can be trusted; uncertain: it comes from "
               "matching, but evidence for or against it is missing; lost: it is a prediction, or "
               "was found and not yet confirmed"},
    Definition{"Alert limit",
               "the error beyond which a tracked pose is misleading information: "
               "<code>alert_limit</code> and <code>alert_limit_deg</code> of the run, 0.5 m and 3° "
               "unless it sets others"},
    Definition{"Reduction",
               "share of the wide-area map’s points that the mean region map leaves out, over all "
               "regions; <em>reduction used</em> is the same for the maps that scans were matched "
               "against"},
    Definition{"Baselines",
               "region maps with as many points in every region, from the points within the "
               "sensor’s reach: <em>random</em> draws them, <em>voxel</em> takes one per voxel, "
               "<em>radius</em> takes those nearest to a viewpoint"},
    Definition{"RMSE, std, p95",
               "root of the mean square; root of the mean squared distance from the mean; "
               "95 of 100 values are below, linear between neighbours"},
};

}  // namespace

std::string method(const Evaluation& e) {
  std::string html = "<h3>Definitions</h3>\n<dl>\n";
  for (const Definition& d : kDefinitions) {
    html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", d.name, d.text);
  }
  for (const Metric* metric : metrics_by_group()) {
    html += fmt::format("<dt>{} (<code>{}</code>)</dt><dd>{}</dd>\n", escaped(heading(*metric)),
                        escaped(metric->key), escaped(metric->doc));
  }
  html += "</dl>\n<h3>Routes</h3>\n<ul>\n";
  for (std::size_t route = 0; route < e.routes.size(); ++route) {
    const auto runs = runs_of(e, route);
    const Run* run = runs.empty() ? nullptr : &runs.front().run->run;
    html += fmt::format("<li>{}: {}, {}; stamps: {}</li>\n", escaped(e.routes[route].name),
                        cli::counted(run == nullptr ? 0 : run->scans.size(), "scan"),
                        cli::counted(e.routes[route].reference.size(), "reference pose"),
                        escaped(run == nullptr ? "none" : run->stamp_rule));
  }
  html +=
      "</ul>\n<h3>Configurations</h3>\n<p>The configuration with which each bundle was built, with "
      "all defaults.</p>\n";
  for (const EvaluatedConfig& config : e.configs) {
    html += fmt::format("<details><summary>{}</summary><pre>{}</pre></details>\n",
                        escaped(config.name), escaped(config.index.config));
  }
  return html;
}

}  // namespace vantage::page
