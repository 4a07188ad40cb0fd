#include "evaluate/report.hpp"

#include <fmt/format.h>

#include "common/table.hpp"
#include "evaluate/page/tables.hpp"
#include "report/html.hpp"

namespace vantage {

std::vector<std::vector<std::string>> comparison(const Evaluation& evaluation) {
  std::vector<std::vector<std::string>> rows{
      {"config", "map", "route", "points", "reduction", "error [cm]", "p95", "[deg]", "lost",
       "switches", "T_align [ms]", "fitness", "coverage", "NVTL", "LCP [1e-6]"}};
  for (std::size_t route = 0; route < evaluation.routes.size(); ++route) {
    for (const page::MapRun& r : page::runs_of(evaluation, route)) {
      const RunSummary& s = r.run->summary;
      rows.push_back({r.config->name, std::string(r.map), evaluation.routes[route].name,
                      cli::grouped(static_cast<std::uint64_t>(s.map_points.mean + 0.5)),
                      fmt::format("{:.1f} %", 100.0 * r.config->reduction()),
                      fmt::format("{:.2f}", 100.0 * s.error_m.mean),
                      fmt::format("{:.2f}", 100.0 * s.error_m.p95),
                      fmt::format("{:.3f}", s.error_deg.mean),
                      fmt::format("{}/{}", s.lost, s.scans), std::to_string(s.switches),
                      fmt::format("{:.1f}", s.align_ms.mean), fmt::format("{:.3f}", s.fitness.mean),
                      fmt::format("{:.1f} %", 100.0 * s.coverage.mean),
                      fmt::format("{:.3f}", s.nvtl.mean), fmt::format("{:.3f}", 1e6 * s.lcp.mean)});
    }
  }
  return rows;
}

Result<std::string> to_html(const Evaluation& evaluation) {
  report::Page html{.title = "Localization in region maps", .subtitle = "", .sections = {}};
  html.subtitle = fmt::format("{} configurations on {} routes", evaluation.configs.size(),
                              evaluation.routes.size());
  html.sections.push_back({"verdict", "Verdict", page::verdict(evaluation)});
  html.sections.push_back({"points", "Points", page::points_table(evaluation)});
  html.sections.push_back({"accuracy", "Accuracy", page::accuracy_tables(evaluation)});
  return to_html(html);
}

}  // namespace vantage
