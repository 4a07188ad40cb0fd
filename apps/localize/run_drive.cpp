#include <fmt/format.h>

#include <cmath>
#include <set>
#include <utility>

#include "localize/run_parts.hpp"
#include "report/html.hpp"
#include "report/plan.hpp"
#include "terminal/counts.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage::run_page {
namespace {

Result<std::string> borders(const RegionDirectory& regions, const report::PlanWindow& window) {
  constexpr std::size_t kMostBorders = 4000;
  VANTAGE_TRY(const auto seen, regions.meeting({window.min, window.max}));
  std::string d;
  if (seen.size() > kMostBorders) return d;
  for (const RegionId region : seen) {
    VANTAGE_TRY(const DirectoryEntry entry, regions.entry(region));
    d += report::outline(entry.region.footprint, window);
  }
  return report::border_path(d);
}

/// Places in a plan that are far enough from those before them to be seen beside them. The size of
/// the plan limits their number, not the length of the run.
class Spread {
 public:
  explicit Spread(double pixels) : pixels_(pixels) {}
  bool is_free(const Eigen::Vector2d& p, const report::PlanWindow& window) {
    const double x = window.x(p.x()), y = window.y(p.y());
    if (x < 0.0 || y < 0.0 || x > window.width || y > window.height()) return false;
    return taken_.emplace(std::lround(x / pixels_), std::lround(y / pixels_)).second;
  }

 private:
  double pixels_;
  std::set<std::pair<long, long>> taken_;
};

}  // namespace

Result<std::string> drive(const RunFacts& facts, const Scans& scans, const ColumnReader& read) {
  VANTAGE_TRY(const auto x, read(kX));
  VANTAGE_TRY(const auto y, read(kY));
  VANTAGE_TRY(const auto region, read(kRegion));
  VANTAGE_TRY(const auto switched, read(kSwitched));
  VANTAGE_TRY(const auto risk, read(column_of("risk")));
  report::Extent tracked, all;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!std::isfinite(x[i])) continue;
    all.see({x[i], y[i]});
    if (scans.is(i, Tracking::tracked)) tracked.see({x[i], y[i]});
  }
  if (all.empty()) return std::string("<p>The sensor was never found.</p>\n");
  const report::PlanWindow window = report::window_of_drive(tracked.empty() ? all : tracked);
  const RunSummary& s = facts.summary;
  std::string svg = report::plan_opening(
      "Drive",
      fmt::format("{}, {} uncertain, {} lost, {}", cli::counted(s.scans, "scan"),
                  cli::grouped(s.count("uncertain")), cli::grouped(s.count("lost")),
                  cli::counted(s.count("switched"), "switch", "switches")),
      window);
  VANTAGE_TRY(const std::string lines, borders(facts.regions, window));
  svg += lines;
  Spread dots(3.0), rings(6.0), rhombs(6.0), crosses(6.0);
  std::string above;  // drawn last, because it must not be covered
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!std::isfinite(x[i])) continue;
    const Eigen::Vector2d p(x[i], y[i]);
    const std::string tip =
        fmt::format("scan {}, {:.1f} s, {:.0f} m\nrisk {}", cli::grouped(i + 1), scans.time[i],
                    scans.way[i], rounded(*find_metric("risk"), risk[i]));
    if (scans.is(i, Tracking::lost)) {
      if (crosses.is_free(p, window)) above += report::plan_cross(p, window, tip + "\nlost");
      continue;
    }
    if (switched[i] > 0.0 && i > 0 && rings.is_free(p, window)) {
      const RegionId id{static_cast<std::uint32_t>(region[i])};
      VANTAGE_TRY(const DirectoryEntry entry, facts.regions.entry(id));
      above += report::plan_ring(p, window, 4.0, tip + "\nswitched to " + entry.region.label);
    }
    if (scans.is(i, Tracking::uncertain)) {
      if (rhombs.is_free(p, window)) above += report::plan_rhomb(p, window, tip + "\nuncertain");
    } else if (dots.is_free(p, window)) {
      svg += report::plan_dot(p, window, "unknown", 2.3, tip);
    }
  }
  svg += above + report::scale_bar(window) + report::plan_end();
  return "<p class=\"legend\"><span><i class=\"dot unknown\"></i>scan tracked</span> " +
         report::legend_of_drive() + "</p>\n" +
         report::figure(
             {svg},
             "Poses of the run. Where scans lie closer than they can be drawn, the first "
             "stands for them. The pose of a lost scan is a prediction.",
             "drive");
}

}  // namespace vantage::run_page
