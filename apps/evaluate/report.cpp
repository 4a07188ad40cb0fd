#include "evaluate/report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "evaluate/page/figures.hpp"
#include "evaluate/page/maps.hpp"
#include "evaluate/page/tables.hpp"
#include "report/html.hpp"
#include "terminal/table.hpp"

namespace vantage {

std::vector<std::vector<std::string>> comparison(const Evaluation& evaluation) {
  std::vector<std::vector<std::string>> rows{
      {"config", "map", "route", "points", "reduction [%]", "error [cm]", "p95 [cm]", "error [deg]",
       "lost", "switches", "T_align [ms]", "fitness", "coverage [%]", "NVTL", "LCP [1e-6]"}};
  const auto text = [](const Statistics& s, double value, int digits) {
    return s.count == 0 ? std::string("-") : fmt::format("{:.{}f}", value, digits);
  };
  for (std::size_t route = 0; route < evaluation.routes.size(); ++route) {
    for (const page::MapRun& r : page::runs_of(evaluation, route)) {
      const RunSummary& s = r.run->summary;
      rows.push_back(
          {r.config->name, std::string(r.map), evaluation.routes[route].name,
           cli::grouped(static_cast<std::uint64_t>(s.map_points.mean + 0.5)),
           fmt::format("{:.1f}", 100.0 * r.config->reduction()),
           text(s.error_m, 100.0 * s.error_m.mean, 2), text(s.error_m, 100.0 * s.error_m.p95, 2),
           text(s.error_deg, s.error_deg.mean, 3), fmt::format("{}/{}", s.lost, s.scans),
           std::to_string(s.switches), text(s.align_ms, s.align_ms.mean, 1),
           text(s.fitness, s.fitness.mean, 3), text(s.coverage, 100.0 * s.coverage.mean, 1),
           text(s.nvtl, s.nvtl.mean, 3), text(s.lcp, 1e6 * s.lcp.mean, 3)});
    }
  }
  return rows;
}

Result<std::string> to_html(const Evaluation& evaluation) {
  const auto number = [](std::size_t n, const char* what) {
    return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
  };
  std::size_t scans = 0;
  for (const EvaluatedConfig& config : evaluation.configs) {
    std::size_t its = 0;
    for (const RouteRun& run : config.routes) its += run.summary.scans;
    scans = std::max(scans, its);
  }
  VANTAGE_TRY(std::string region_maps, page::region_maps(evaluation));
  VANTAGE_TRY(std::string trajectories, page::trajectories(evaluation));
  page::View3d view = page::view_3d(evaluation);
  return to_html(report::Page{
      .title = "Localization in region maps",
      .subtitle = fmt::format("{} on {}, {}", number(evaluation.configs.size(), "configuration"),
                              number(evaluation.routes.size(), "route"), number(scans, "scan")),
      .sections = {{"verdict", "Verdict", page::verdict(evaluation)},
                   {"points", "Points", page::points_table(evaluation)},
                   {"accuracy", "Accuracy", page::accuracy_tables(evaluation)},
                   {"regionmaps", "Region maps", std::move(region_maps)},
                   {"alignment", "Alignment time", page::alignment_figures(evaluation)},
                   {"fitness", "Fitness", page::fitness_figures(evaluation)},
                   {"lcp", "LCP", page::lcp_figures(evaluation)},
                   {"error", "Error", page::error_figures(evaluation)},
                   {"trajectories", "Trajectories", std::move(trajectories)},
                   {"view", "3-D view", std::move(view.body)},
                   {"method", "How it was measured", page::method(evaluation)}},
      .scripts = std::move(view.scripts)});
}

}  // namespace vantage
