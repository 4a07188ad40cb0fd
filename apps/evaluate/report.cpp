#include "evaluate/report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "evaluate/page/figures.hpp"
#include "evaluate/page/maps.hpp"
#include "evaluate/page/tables.hpp"
#include "report/html.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage {
namespace {

/// The columns of numbers of the terminal's table.
template <class F>
void for_each_brief(const F& f) {
  for (const Metric* metric : metrics_by_group()) {
    for (const NamedStatistic& statistic : statistics_in(metric->brief)) f(*metric, statistic);
  }
}

std::string cell(const RunSummary& summary, const Metric& metric, const NamedStatistic& statistic) {
  const Statistics s = summary[metric.key];
  if (s.count == 0) return "-";
  const double value = s.*statistic.member;
  if (!metric.counted_of.empty())
    return fmt::format("{}/{}", cli::grouped(static_cast<std::uint64_t>(value + 0.5)),
                       cli::grouped(s.count));
  return shown(metric, value);
}

}  // namespace

std::vector<std::vector<std::string>> comparison(const Evaluation& evaluation) {
  std::vector<std::vector<std::string>> rows{{"config", "map", "route"}};
  for_each_brief([&](const Metric& metric, const NamedStatistic& statistic) {
    const bool first = statistic.name == statistics_in(metric.brief).front().name;
    rows.front().push_back(first ? heading(metric)
                                 : fmt::format("{} [{}]", statistic.name, metric.unit->shown));
  });
  for (std::size_t route = 0; route < evaluation.routes.size(); ++route) {
    for (const page::MapRun& r : page::runs_of(evaluation, route)) {
      auto& row = rows.emplace_back(
          std::vector{r.config->name, std::string(r.map), evaluation.routes[route].name});
      for_each_brief([&](const Metric& metric, const NamedStatistic& statistic) {
        row.push_back(cell(r.run->summary, metric, statistic));
      });
    }
  }
  return rows;
}

Result<std::string> to_html(const Evaluation& evaluation) {
  std::size_t scans = 0;
  for (const EvaluatedConfig& config : evaluation.configs) {
    std::size_t its = 0;
    for (const RouteRun& run : config.routes) its += run.summary.scans;
    scans = std::max(scans, its);
  }
  VANTAGE_TRY(std::string region_maps, page::region_maps(evaluation));
  VANTAGE_TRY(std::string trajectories, page::trajectories(evaluation));
  VANTAGE_TRY(std::string localizability, page::localizability(evaluation));
  page::View3d view = page::view_3d(evaluation);
  report::Page page{
      .title = "Localization in region maps",
      .subtitle =
          fmt::format("{} on {}, {}", cli::counted(evaluation.configs.size(), "configuration"),
                      cli::counted(evaluation.routes.size(), "route"), cli::counted(scans, "scan")),
      .sections = {{"verdict", "Verdict", page::verdict(evaluation)},
                   {"points", "Points", page::points_table(evaluation)},
                   {"accuracy", "Accuracy", page::accuracy_tables(evaluation)},
                   {"regionmaps", "Region maps", std::move(region_maps)},
                   {"alignment", "Alignment time", page::alignment_figures(evaluation)},
                   {"fitness", "Fitness", page::fitness_figures(evaluation)},
                   {"lcp", "LCP", page::lcp_figures(evaluation)},
                   {"error", "Error", page::error_figures(evaluation)},
                   {"motion", "Motion", page::motion_figures(evaluation)},
                   {"risk", "Risk", page::risk_figures(evaluation)},
                   {"trajectories", "Trajectories", std::move(trajectories)},
                   {"view", "3-D view", std::move(view.body)},
                   {"method", "How it was measured", page::method(evaluation)}},
      .scripts = std::move(view.scripts)};
  if (!localizability.empty()) {
    const auto before = std::find_if(page.sections.begin(), page.sections.end(),
                                     [](const auto& section) { return section.id == "view"; });
    page.sections.insert(before, {"localizability", "Localizability", std::move(localizability)});
  }
  return to_html(page);
}

}  // namespace vantage
