#include <fmt/format.h>

#include <array>

#include "evaluate/page/tables.hpp"
#include "report/html.hpp"

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
    Definition{"T<sub>align</sub> [ms]",
               "time of scan matching alone: map in memory, scan thinned (Sec. 3.3)"},
    Definition{"S<sub>fitness</sub>",
               "mean over the scan’s points of the mean over their neighbouring "
               "voxels of −d₁ exp(−d₂/2 · m) − d₃, m the squared Mahalanobis distance "
               "(Eq. 12); a point without a voxel counts 0. d₁, d₂, d₃ follow from outlier "
               "ratio and resolution (Magnusson 2009, Eqs. 6.8–6.9)"},
    Definition{
        "LCP",
        "S<sub>fitness</sub> / N<sub>point</sub>, the number of points of the region map (Eq. 13)"},
    Definition{"Coverage", "share of a scan’s points that have at least one voxel in the map"},
    Definition{"NVTL",
               "nearest voxel transformation likelihood: mean over the matched points of the best "
               "voxel’s likelihood"},
    Definition{"Absolute error",
               "distance and angle between estimate and reference of the same stamp; "
               "trajectories are not aligned, since the map’s frame is given"},
    Definition{
        "Relative error",
        "translation and angle of (true motion)⁻¹ · (estimated motion), from each scan "
        "to the next, and to the first scan at least 10 m on along the reference; both tracked"},
    Definition{"Lost",
               "the matcher’s pose was not to be believed: a prediction stands in for it, and it "
               "counts in no error or score"},
    Definition{"Beyond 2 m or 5°",
               "scans whose pose, tracked or not, is that far from the reference"},
    Definition{"Stall [ms]",
               "time that a scan waited for its region’s map; a blocking load is a switch to a map "
               "that was not ready"},
    Definition{"Memory [MB]",
               "most that maps ready to match against took at once; 1 MB = 10⁶ bytes"},
    Definition{"Reduction",
               "share of the wide-area map’s points that the mean region map does without"},
    Definition{"Opponents",
               "region maps with as many points in every region, from the points within the "
               "sensor’s reach: <em>random</em> draws them, <em>voxel</em> takes one a voxel, "
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
  html += "</dl>\n<h3>Routes</h3>\n<ul>\n";
  for (std::size_t route = 0; route < e.routes.size(); ++route) {
    const auto runs = runs_of(e, route);
    const Run* run = runs.empty() ? nullptr : &runs.front().run->run;
    html += fmt::format("<li>{}: {} scans, {} reference poses; stamps: {}</li>\n",
                        escaped(e.routes[route].name), run == nullptr ? 0 : run->scans.size(),
                        e.routes[route].reference.size(),
                        escaped(run == nullptr ? "none" : run->stamp_rule));
  }
  html +=
      "</ul>\n<h3>Configurations</h3>\n<p>Each as its bundle was built, with all defaults.</p>\n";
  for (const EvaluatedConfig& config : e.configs) {
    html += fmt::format("<details><summary>{}</summary><pre>{}</pre></details>\n",
                        escaped(config.name), escaped(config.index.config));
  }
  return html;
}

}  // namespace vantage::page
