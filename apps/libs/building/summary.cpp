#include "building/summary.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "terminal/shell_word.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/statistics.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage::building {
namespace {

/// The largest amount of memory that the process has used [bytes].
std::uint64_t peak_memory() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return 1024 * static_cast<std::uint64_t>(usage.ru_maxrss);
}

void print_report(const BuildReport& report, const MapIndex& index, std::uint64_t bytes,
                  const Prepared& prepared, const cli::Style& style) {
  const WideAreaMap& map = prepared.map;
  std::vector<double> seen(report.seen.begin(), report.seen.end()), kept;
  std::uint64_t elements = 0;
  for (std::size_t r = 0; r < index.regions.size(); ++r) {
    kept.push_back(static_cast<double>(report.regions[r].points));
    elements += index.regions[r].elements;
  }

  cli::TextTable table(
      {"", "regions", "points (mean)", "min", "max", "std", "reduction [%]", "size [MB]"});
  table.add({"wide-area map", "1", cli::grouped(report.map_points), "", "", "", "", ""});
  const auto add = [&](const std::string& name, const std::vector<double>& points,
                       const std::string& size) {
    const Statistics s = statistics_of(points);
    const auto count = [](double x) { return cli::grouped(static_cast<std::uint64_t>(x + 0.5)); };
    const double reduction = 100.0 * (1.0 - s.mean / static_cast<double>(report.map_points));
    table.add({name, cli::grouped(points.size()), count(s.mean), count(s.min), count(s.max),
               count(s.std), fmt::format("{:.1f}", reduction), size});
  };
  if (seen != kept) add("seen", seen, "");  // min_views and thinning have left some points out
  add("region maps", kept, fmt::format("{:.1f}", static_cast<double>(bytes) / 1e6));
  std::cout << table.to_string(style);
  std::cout << fmt::format(
      "\n{}{}; partition {:.2f} s, ground {:.2f} s, visibility {:.2f} s\n",
      report.ground_points > 0 ? cli::counted(report.ground_points, "ground point") + ", " : "",
      cli::counted(report.viewpoints, "viewpoint"), report.seconds_partition, report.seconds_ground,
      report.seconds_visibility);
  std::cout << fmt::format(
      "{:.1f} core-seconds for visibility, {:.3g} for each viewpoint and million points; peak "
      "memory {} MB\n",
      report.core_seconds_visibility, report.core_seconds_a_viewpoint_and_million_points(),
      cli::grouped((peak_memory() + 500'000) / 1'000'000));
  if (report.core_seconds_selection > 0) {
    std::cout << fmt::format("{:.1f} core-seconds for choosing elements\n",
                             report.core_seconds_selection);
  }
  if (elements > 0) {
    std::cout << fmt::format("prepared maps are stored: {} of the matcher\n",
                             cli::counted(elements, "element"));
  }
  if (map.dropped > 0) {
    std::cout << fmt::format("{} with NaN or infinite coordinates {} dropped\n",
                             cli::counted(map.dropped, "map point"),
                             cli::form(map.dropped, "was", "were"));
  }
  if (map.unlisted_tiles > 0) {
    std::cout << fmt::format(
        "{} beside the map's tiles {} not in the tiles' metadata and {} left out\n",
        cli::counted(map.unlisted_tiles, "file"), cli::form(map.unlisted_tiles, "is", "are"),
        cli::form(map.unlisted_tiles, "was", "were"));
  }
  if (report.skipped_viewpoints > 0) {
    std::cout << fmt::format("{} of the viewpoints would show too little new and {} skipped\n",
                             cli::grouped(report.skipped_viewpoints),
                             cli::form(report.skipped_viewpoints, "was", "were"));
  }
  if (report.unreachable_voxels > 0) {
    std::cout << fmt::format("the ground of {} is not reachable and has no viewpoint\n",
                             cli::counted(report.unreachable_voxels, "voxel"));
  }
  if (report.places_outside > 0) {
    std::cout << fmt::format("{} along the trajectory {} in no region and {} left out\n",
                             cli::counted(report.places_outside, "place"),
                             cli::form(report.places_outside, "is", "are"),
                             cli::form(report.places_outside, "was", "were"));
  }
  if (report.regions_without_viewpoints > 0) {
    const std::size_t regions = report.regions_without_viewpoints;
    std::cout << fmt::format("{} {} no {}, so no viewpoint: {} empty\n",
                             cli::counted(regions, "region"), cli::form(regions, "holds", "hold"),
                             report.ground_points == 0       ? "part of the trajectory"
                             : report.unreachable_voxels > 0 ? "reachable ground"
                                                             : "ground",
                             cli::form(regions, "its map is", "their maps are"));
  }
  if (report.regions_that_see_nothing > 0) {
    const std::size_t regions = report.regions_that_see_nothing;
    std::cout << fmt::format(
        "{} {} viewpoints that see no point (look at sensor_height and max_range): {} empty\n",
        cli::counted(regions, "region"), cli::form(regions, "has", "have"),
        cli::form(regions, "its map is", "their maps are"));
  }
  if (prepared.config.matcher) {
    std::cout << fmt::format("`vantage assess {}` measures how well a sensor is localized in it\n",
                             cli::shell_word(prepared.config.file));
  }
}

nlohmann::ordered_json to_json(const BuildReport& report, const MapIndex& index,
                               std::uint64_t bytes, const WideAreaMap& map) {
  nlohmann::ordered_json regions = nlohmann::ordered_json::array();
  for (std::uint32_t r = 0; r < report.partition.size(); ++r) {
    regions.push_back({{"label", report.partition[RegionId{r}].label},
                       {"points", report.regions[r].points},
                       {"points_seen", report.seen[r]},
                       {"elements", index.regions[r].elements},
                       {"viewpoints", index.regions[r].viewpoints},
                       {"bytes", index.regions[r].bytes}});
  }
  return {
      {"map_points", report.map_points},
      {"dropped_points", map.dropped},
      {"unlisted_tiles", map.unlisted_tiles},
      {"ground_points", report.ground_points},
      {"viewpoints", report.viewpoints},
      {"skipped_viewpoints", report.skipped_viewpoints},
      {"unreachable_voxels", report.unreachable_voxels},
      {"places_outside", report.places_outside},
      {"regions_without_viewpoints", report.regions_without_viewpoints},
      {"regions_that_see_nothing", report.regions_that_see_nothing},
      {"seconds",
       {{"partition", report.seconds_partition},
        {"ground", report.seconds_ground},
        {"visibility", report.seconds_visibility}}},
      {"core_seconds",
       {{"visibility", report.core_seconds_visibility},
        {"selection", report.core_seconds_selection},
        {"a_viewpoint_and_million_points", report.core_seconds_a_viewpoint_and_million_points()}}},
      {"peak_memory_bytes", peak_memory()},
      {"bytes", bytes},
      {"regions", std::move(regions)}};
}

}  // namespace

Result<void> print_summary(const BuildReport& report, const Prepared& prepared,
                           const cli::CommonOptions& options) {
  VANTAGE_TRY(const Bundle bundle, prepared.build.bundle());
  VANTAGE_TRY(const auto index, bundle.index());
  if (options.json) {
    std::cout << json_text(to_json(report, *index, bundle.bytes(), prepared.map));
  } else {
    print_report(report, *index, bundle.bytes(), prepared, options.style());
  }
  return {};
}

}  // namespace vantage::building
