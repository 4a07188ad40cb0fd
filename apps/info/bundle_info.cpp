#include "info/bundle_info.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>

#include "info/lines.hpp"
#include "localizability/localizability.hpp"
#include "terminal/table.hpp"
#include "vantage/engine/localizer_params.hpp"

namespace vantage {
namespace {

constexpr const char* kFormat = "bundle of region maps";
constexpr std::size_t kWorst = 5;
constexpr double kAlertLimit = LocalizerParams{}.alert_limit;  // [m]

Eigen::AlignedBox3d extent_of(const BundleSummary& bundle) {
  const Bounds3& map = bundle.map_bounds;
  return map.empty() ? Eigen::AlignedBox3d() : Eigen::AlignedBox3d(map.min, map.max);
}

double mean_points(const BundleSummary& bundle) {
  return static_cast<double>(bundle.sum.points) / static_cast<double>(bundle.regions);
}

Lines lines_of(const BundleInfo& info) {
  const BundleSummary& all = info.summary;
  Lines lines{{"path", info.path.string()},
              {"format", kFormat},
              {"size [MB]", fmt::format("{:.2f}", static_cast<double>(info.bytes) / 1e6)},
              {"regions", fmt::format("{}, {} of them empty", cli::grouped(all.regions),
                                      cli::grouped(all.empty_regions))},
              {"points of the map", cli::grouped(all.map_points)}};
  lines.emplace_back(
      "points a region",
      fmt::format("{} ({} to {})",
                  cli::grouped(static_cast<std::uint64_t>(std::llround(mean_points(all)))),
                  cli::grouped(all.least_points), cli::grouped(all.most_points)));
  lines.emplace_back("extent [m]", box_text(extent_of(all)));
  return lines;
}

std::string some_of(const Localizability& all, std::size_t sites) {
  return fmt::format("{} {} ({:.1f} %)", cli::grouped(sites), sites == 1 ? "site" : "sites",
                     100.0 * all.share(sites));
}

Lines lines_of(const Atlas& atlas) {
  const Localizability all = localizability_of(atlas, kAlertLimit);
  Lines lines{{"atlas for", atlas.calibration.matcher.plugin}, {"sites", cli::grouped(all.sites)}};
  if (all.unmatched > 0) lines.emplace_back("matching nothing", some_of(all, all.unmatched));
  if (all.expected_error.count > 0) {
    lines.emplace_back(
        "expected error [m]",
        fmt::format("{:.3f} median, {:.3f} or less at 95 % of the sites, {:.3f} at most",
                    all.expected_error.median, all.expected_error.p95, all.expected_error.max));
  }
  lines.emplace_back(fmt::format("error above {:g} m", kAlertLimit),
                     some_of(all, all.beyond_limit));
  lines.emplace_back("weak in a direction",
                     fmt::format("{}: sigma more than {:g} times that across",
                                 some_of(all, all.weak), kWeakRatio));
  if (all.basin.count > 0) {
    lines.emplace_back("basin [m]", fmt::format("{:.1f} median, {:.1f} smallest", all.basin.median,
                                                all.basin.min));
  }
  lines.emplace_back("with alike places", some_of(all, all.alike));
  return lines;
}

/// The sites to look at first.
std::string worst_text(const BundleInfo& info, const cli::Style& style) {
  cli::TextTable table({"worst sites, in region", "x [m]", "y [m]", "z [m]", "expected error [m]",
                        "weak sigma [m]", "bearing [deg]", "basin [m]", "alike x [m]",
                        "alike y [m]", "likeness"});
  for (const Site* site : worst_sites(*info.atlas, kWorst)) {
    std::vector<std::string> row{
        cli::one_line(info.label_of(*site)), fmt::format("{:.1f}", site->position.x()),
        fmt::format("{:.1f}", site->position.y()), fmt::format("{:.1f}", site->position.z())};
    if (const auto& p = site->precision) {
      row.push_back(fmt::format("{:.3f}", p->expected_error));
      row.push_back(fmt::format("{:.3f}", p->sigma_weak));
      row.push_back(fmt::format("{}", std::lround(weak_bearing(*p)) % 180));
      row.push_back(fmt::format("{:.1f}", p->basin));
    } else {
      row.insert(row.end(), {"no match", "-", "-", "-"});
    }
    if (const AlikePlace* alike = nearest_alike(*site)) {
      row.push_back(fmt::format("{:.1f}", alike->T_map_scan.translation.x()));
      row.push_back(fmt::format("{:.1f}", alike->T_map_scan.translation.y()));
      row.push_back(fmt::format("{:.2f}", alike->likeness));
    } else {
      row.insert(row.end(), {"-", "-", "-"});
    }
    table.add(std::move(row));
  }
  return table.to_string(style) +
         "The bearing is that of the weak direction, clockwise from the map's y axis; 'alike' is "
         "the nearest alike place.\n";
}

nlohmann::ordered_json json_of(const Site& site, const BundleInfo& info) {
  nlohmann::ordered_json json{{"region", info.label_of(site)},
                              {"position", vector_json(site.position)},
                              {"expected_error", nullptr}};
  if (const auto& p = site.precision) {
    json["expected_error"] = p->expected_error;
    json["sigma_strong"] = p->sigma_strong;
    json["sigma_weak"] = p->sigma_weak;
    json["weak_bearing"] = weak_bearing(*p);
    json["basin"] = p->basin;
  }
  json["nearest_alike"] = nullptr;
  if (const AlikePlace* alike = nearest_alike(site)) {
    json["nearest_alike"] = {{"position", vector_json(alike->T_map_scan.translation)},
                             {"distance", distance(site, *alike)},
                             {"likeness", alike->likeness}};
  }
  return json;
}

nlohmann::ordered_json json_of(const Atlas& atlas, const BundleInfo& info) {
  const Localizability all = localizability_of(atlas, kAlertLimit);
  nlohmann::ordered_json json{{"matcher",
                               {{"plugin", atlas.calibration.matcher.plugin},
                                {"params", atlas.calibration.matcher.params}}},
                              {"sites", all.sites},
                              {"unmatched_sites", all.unmatched},
                              {"alert_limit", kAlertLimit},
                              {"sites_beyond_alert_limit", all.beyond_limit},
                              {"weak_ratio", kWeakRatio},
                              {"weak_sites", all.weak},
                              {"sites_with_alike_places", all.alike},
                              {"expected_error", nullptr},
                              {"basin", nullptr}};
  if (all.expected_error.count > 0) {
    json["expected_error"] = {{"median", all.expected_error.median},
                              {"p95", all.expected_error.p95},
                              {"max", all.expected_error.max}};
    json["basin"] = {{"median", all.basin.median}, {"min", all.basin.min}};
  }
  json["worst_sites"] = nlohmann::ordered_json::array();
  for (const Site* site : worst_sites(atlas, kWorst)) {
    json["worst_sites"].push_back(json_of(*site, info));
  }
  return json;
}

}  // namespace

Result<std::optional<BundleInfo>> inspect_bundle(const std::filesystem::path& path,
                                                 const PluginLoader& plugins) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return std::optional<BundleInfo>();
  const auto bundle = Bundle::open(path, plugins);
  if (!bundle) {
    // A folder of scans or tiles.
    if (bundle.error().code == ErrorCode::not_found) return std::optional<BundleInfo>();
    return fail(bundle.error());
  }
  BundleInfo info{.path = path,
                  .bytes = size_of(path),
                  .summary = bundle->directory()->summary(),
                  .atlas = {},
                  .labels = {}};
  VANTAGE_TRY(info.atlas, Atlas::of_bundle(*bundle));
  if (!info.atlas) return std::optional<BundleInfo>(std::move(info));
  for (const Site* site : worst_sites(*info.atlas, kWorst)) {
    VANTAGE_TRY(const DirectoryEntry entry, bundle->directory()->entry(site->region));
    info.labels[site->region] = entry.region.label;
  }
  return std::optional<BundleInfo>(std::move(info));
}

std::string to_text(const BundleInfo& info, const cli::Style& style) {
  Lines lines = lines_of(info);
  if (!info.atlas) {
    lines.emplace_back("atlas", std::string("none: ") + kHowToGetAnAtlas);
    return to_text(lines, style);
  }
  for (auto& line : lines_of(*info.atlas)) lines.push_back(std::move(line));
  const std::string text = to_text(lines, style);
  return info.atlas->sites.empty() ? text : text + '\n' + worst_text(info, style);
}

nlohmann::ordered_json to_json(const BundleInfo& info) {
  const BundleSummary& all = info.summary;
  nlohmann::ordered_json json{{"path", info.path.string()},
                              {"format", kFormat},
                              {"bytes", info.bytes},
                              {"regions", all.regions},
                              {"empty_regions", all.empty_regions},
                              {"map_points", all.map_points},
                              {"region_points",
                               {{"mean", mean_points(all)},
                                {"min", static_cast<double>(all.least_points)},
                                {"max", static_cast<double>(all.most_points)}}},
                              {"min", nullptr},
                              {"max", nullptr},
                              {"atlas", nullptr}};
  if (const auto extent = extent_of(all); !extent.isEmpty()) {
    json["min"] = vector_json(extent.min());
    json["max"] = vector_json(extent.max());
  }
  if (info.atlas) json["atlas"] = json_of(*info.atlas, info);
  return json;
}

}  // namespace vantage
