#include "info/bundle_info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>
#include <vector>

#include "info/lines.hpp"
#include "info/region_list.hpp"
#include "localizability/localizability.hpp"
#include "terminal/table.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/engine/toml.hpp"
#include "vantage/kit/file_system.hpp"

namespace vantage {
namespace {

constexpr const char* kFormat = "bundle of region maps";
constexpr std::size_t kWorst = 5;
constexpr double kAlertLimit = LocalizerParams{}.alert_limit;  // [m]

Eigen::AlignedBox3d extent_of(const BundleSummary& bundle) {
  const Bounds3& map = bundle.map_bounds;
  return map.empty() ? Eigen::AlignedBox3d() : Eigen::AlignedBox3d(map.min, map.max);
}

double mean_of(std::uint64_t sum, const BundleSummary& bundle) {
  return static_cast<double>(sum) / static_cast<double>(bundle.regions);
}

/// What is stored of the regions.
std::string content_text(const BundleInfo& info) {
  const RegionSummary& sum = info.summary.sum;
  const std::string prepared =
      "prepared maps" + (info.matcher.empty() ? std::string() : " of " + info.matcher);
  if (sum.elements == 0) return sum.points > 0 ? "points" : "none: all region maps are empty";
  return sum.points > 0 ? "points and " + prepared : prepared;
}

/// What a lost sensor is searched for with.
std::string relocalizer_text(const BundleInfo& info) {
  if (!info.relocalizer) {
    return info.summary.sum.points > 0 ? "none: a search makes it from the points" : "none";
  }
  const auto& [plugin, library, params, where] = *info.relocalizer;
  return plugin + (params.entries.empty() ? "" : " " + to_toml(Value{params, {}}));
}

/// Files of one ending are counted together: "tiles.bin 3.20 MB, 25 .region files 0.31 MB".
std::string files_text(const BundleInfo& info) {
  std::string text;
  for (const FileGroup& group : info.files) {
    text +=
        fmt::format("{}{} {:.2f} MB", text.empty() ? "" : ", ",
                    group.count == 1 ? group.name : cli::counted(group.count, group.name + " file"),
                    static_cast<double>(group.bytes) / 1e6);
  }
  return text;
}

std::vector<FileGroup> files_in(const std::filesystem::path& folder) {
  std::map<std::string, FileGroup> groups;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    std::error_code unreadable;
    if (!it->is_regular_file(unreadable)) continue;
    FileGroup& group = groups[it->path().extension().string()];
    group.name =
        group.count == 0 ? it->path().filename().string() : it->path().extension().string();
    ++group.count;
    group.bytes += io::bytes_of(it->path());
  }
  std::vector<FileGroup> files;
  for (auto& [extension, group] : groups) files.push_back(std::move(group));
  std::stable_sort(files.begin(), files.end(),
                   [](const FileGroup& a, const FileGroup& b) { return a.bytes > b.bytes; });
  return files;
}

Lines lines_of(const BundleInfo& info) {
  const BundleSummary& all = info.summary;
  const bool known = all.map_points > 0;  // not in a bundle of another program
  Lines lines{{"path", info.path.string()},
              {"format", kFormat},
              {"size [MB]", fmt::format("{:.2f}", static_cast<double>(info.bytes) / 1e6)},
              {"regions", fmt::format("{}, {} of them empty", cli::grouped(all.regions),
                                      cli::grouped(all.empty_regions))},
              {"points of the map", known ? cli::grouped(all.map_points) : "not known"},
              {"content", content_text(info)}};
  if (all.sum.points > 0 || all.sum.elements == 0) {
    lines.emplace_back(
        "points a region",
        fmt::format("{} ({} to {})", cli::grouped_whole(mean_of(all.sum.points, all)),
                    cli::grouped(all.least_points), cli::grouped(all.most_points)));
  }
  if (all.sum.elements > 0) {
    lines.emplace_back("elements a region",
                       fmt::format("{}, {} in all: what the matcher compares scans with",
                                   cli::grouped_whole(mean_of(all.sum.elements, all)),
                                   cli::grouped(all.sum.elements)));
  }
  lines.emplace_back("index of places", relocalizer_text(info));
  if (!info.files.empty()) lines.emplace_back("files", files_text(info));
  lines.emplace_back("extent [m]", box_text(extent_of(all)));
  return lines;
}

/// One column of predicted errors.
std::vector<float> column_of(std::span<const PredictedError> predicted,
                             float PredictedError::*which) {
  std::vector<float> errors;
  for (const PredictedError& at : predicted) errors.push_back(at.*which);
  return errors;
}

/// A region whose elements are not enough at some of its places.
struct Missed {
  RegionId region;
  double error = 0.0, whole = 0.0;  // that 95 % of the places keep, kept and all elements [m]
};
/// Those that miss the target, the worst first.
std::vector<Missed> missed(const PredictedErrors& predicted, double target) {
  std::vector<Missed> missed;
  for (std::uint32_t r = 0; r < predicted.regions.size(); ++r) {
    if (predicted.regions[r].empty()) continue;
    const auto kept = [&](float PredictedError::*which) {
      return error_kept_by(PredictedErrors::kShare, column_of(predicted.regions[r], which));
    };
    const double error = kept(&PredictedError::error);
    if (error > target) missed.push_back({RegionId{r}, error, kept(&PredictedError::whole)});
  }
  std::ranges::stable_sort(missed, std::greater(), &Missed::error);
  return missed;
}

/// Over all regions.
struct ErrorsOfAll {
  std::size_t places = 0;
  double expected = 0.0;           // median [m]
  double median = 0.0, p95 = 0.0;  // of the promised errors [m]
  std::size_t without_place = 0;   // regions without a place
};
ErrorsOfAll errors_of_all(const PredictedErrors& predicted) {
  ErrorsOfAll of;
  std::vector<float> expected, all;
  for (const auto& region : predicted.regions) {
    if (region.empty()) ++of.without_place;
    for (const PredictedError& at : region) {
      expected.push_back(at.expected);
      all.push_back(at.error);
    }
  }
  of.places = all.size();
  if (all.empty()) return of;
  of.expected = error_kept_by(0.5, std::move(expected));
  of.median = error_kept_by(0.5, all);
  of.p95 = error_kept_by(PredictedErrors::kShare, std::move(all));
  return of;
}

std::string metres(double error) {
  return std::isfinite(error) ? fmt::format("{:.3f}", error) : std::string("unbounded");
}

/// What the build expects of the elements that a selector kept.
Lines lines_of(const PredictedErrors& predicted, const BundleInfo& info) {
  const ErrorsOfAll all = errors_of_all(predicted);
  const std::string without = all.without_place == 0
                                  ? std::string()
                                  : fmt::format("; {} without a place that sees anything",
                                                cli::counted(all.without_place, "region"));
  if (all.places == 0) return {{"predicted error [m]", "none" + without}};
  Lines lines{
      {"predicted error [m]",
       fmt::format("{} expected and {} promised (medians), at most {} promised at 95 % of {}{}",
                   metres(all.expected), metres(all.median), metres(all.p95),
                   cli::counted(all.places, "place"), without)}};
  if (!info.target_error) return lines;
  const std::vector<Missed> some = missed(predicted, *info.target_error);
  std::string text = fmt::format("missed in {}", cli::counted(some.size(), "region"));
  for (std::size_t k = 0; k < std::min(some.size(), kWorst); ++k) {
    const Missed& region = some[k];
    text += fmt::format("{} {} {} ({} with all elements)",
                        k > 0                  ? ","
                        : some.size() > kWorst ? ", the worst are"
                                               : ":",
                        cli::one_line(info.label_of(region.region)), metres(region.error),
                        metres(region.whole));
  }
  lines.emplace_back(fmt::format("target of {:g} m", *info.target_error),
                     some.empty() ? std::string("kept in all regions") : text);
  return lines;
}

nlohmann::ordered_json json_of(const PredictedErrors& predicted, const BundleInfo& info) {
  const ErrorsOfAll all = errors_of_all(predicted);
  const auto number = [](double x) { return std::isfinite(x) ? nlohmann::json(x) : nullptr; };
  nlohmann::ordered_json json{{"places", all.places},
                              {"expected", all.places > 0 ? number(all.expected) : nullptr},
                              {"median", all.places > 0 ? number(all.median) : nullptr},
                              {"p95", all.places > 0 ? number(all.p95) : nullptr},
                              {"target", nullptr}};
  if (!info.target_error) return json;
  json["target"] = *info.target_error;
  const std::vector<Missed> some = missed(predicted, *info.target_error);
  json["regions_missing_it"] = some.size();
  json["worst_regions"] = nlohmann::ordered_json::array();
  for (const Missed& region : std::span(some).first(std::min(some.size(), kWorst))) {
    json["worst_regions"].push_back({{"region", info.label_of(region.region)},
                                     {"p95", number(region.error)},
                                     {"p95_with_all_elements", number(region.whole)}});
  }
  return json;
}

std::string some_of(const Localizability& all, std::size_t sites) {
  return fmt::format("{} ({:.1f} %)", cli::counted(sites, "site"), 100.0 * all.share(sites));
}

Lines lines_of(const Atlas& atlas) {
  const Localizability all = localizability_of(atlas, kAlertLimit);
  Lines lines{{"atlas for", atlas.matcher.plugin}, {"sites", cli::grouped(all.sites)}};
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
        cli::one_line(info.label_of(site->region)), fmt::format("{:.1f}", site->position.x()),
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
  nlohmann::ordered_json json{{"region", info.label_of(site.region)},
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
  nlohmann::ordered_json json{
      {"matcher", {{"plugin", atlas.matcher.plugin}, {"params", atlas.matcher.params}}},
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
                                                 const PluginLoader& plugins, bool each_region) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return std::optional<BundleInfo>();
  const auto bundle = Bundle::open(path, plugins);
  if (!bundle) {
    // A folder of scans or tiles.
    if (bundle.error().code == ErrorCode::not_found) return std::optional<BundleInfo>();
    return fail(bundle.error());
  }
  BundleInfo info{.path = path,
                  .bytes = bundle->bytes(),
                  .files = files_in(path),
                  .summary = bundle->directory()->summary(),
                  .matcher = {},
                  .relocalizer = {},
                  .atlas = {},
                  .predicted = {},
                  .target_error = {},
                  .labels = {},
                  .regions = {}};
  if (const auto& built_with = bundle->built_with(); built_with && built_with->matcher) {
    info.matcher = built_with->matcher->plugin;
    if (built_with->selector) info.target_error = built_with->selector->target_error;
  }
  VANTAGE_TRY(info.relocalizer, bundle->indexed_by());
  VANTAGE_TRY(info.atlas, Atlas::of_bundle(*bundle));
  VANTAGE_TRY(info.predicted, PredictedErrors::of_bundle(*bundle));
  std::vector<RegionId> named;
  if (info.atlas) {
    for (const Site* site : worst_sites(*info.atlas, kWorst)) named.push_back(site->region);
  }
  if (info.predicted && info.target_error) {
    const std::vector<Missed> some = missed(*info.predicted, *info.target_error);
    for (const Missed& region : std::span(some).first(std::min(some.size(), kWorst))) {
      named.push_back(region.region);
    }
  }
  for (const RegionId region : named) {
    VANTAGE_TRY(const DirectoryEntry entry, bundle->directory()->entry(region));
    info.labels[region] = entry.region.label;
  }
  for (std::uint32_t r = 0; each_region && r < info.summary.regions; ++r) {
    VANTAGE_TRY(DirectoryEntry entry, bundle->directory()->entry(RegionId{r}));
    info.regions.push_back(std::move(entry));
  }
  return std::optional<BundleInfo>(std::move(info));
}

std::string to_text(const BundleInfo& info, const cli::Style& style) {
  Lines lines = lines_of(info);
  if (info.predicted) {
    for (auto& line : lines_of(*info.predicted, info)) lines.push_back(std::move(line));
  }
  if (info.atlas) {
    for (auto& line : lines_of(*info.atlas)) lines.push_back(std::move(line));
  } else {
    lines.emplace_back("atlas", std::string("none: ") + kHowToGetAnAtlas);
  }
  std::string text = to_text(lines, style);
  if (info.atlas && !info.atlas->sites.empty()) text += '\n' + worst_text(info, style);
  if (!info.regions.empty()) text += '\n' + to_text(std::span(info.regions), style);
  return text;
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
                               {{"mean", mean_of(all.sum.points, all)},
                                {"min", static_cast<double>(all.least_points)},
                                {"max", static_cast<double>(all.most_points)}}},
                              {"region_elements", {{"mean", mean_of(all.sum.elements, all)}}},
                              {"prepared_for", nullptr},
                              {"relocalizer", nullptr},
                              {"files", nlohmann::ordered_json::array()},
                              {"min", nullptr},
                              {"max", nullptr},
                              {"predicted_error", nullptr},
                              {"atlas", nullptr}};
  if (const auto extent = extent_of(all); !extent.isEmpty()) {
    json["min"] = vector_json(extent.min());
    json["max"] = vector_json(extent.max());
  }
  if (all.sum.elements > 0 && !info.matcher.empty()) json["prepared_for"] = info.matcher;
  if (info.relocalizer) {
    json["relocalizer"] = {{"plugin", info.relocalizer->plugin},
                           {"params", to_toml(info.relocalizer->params)}};
  }
  for (const FileGroup& group : info.files) {
    json["files"].push_back({{"name", group.name}, {"count", group.count}, {"bytes", group.bytes}});
  }
  if (info.predicted) json["predicted_error"] = json_of(*info.predicted, info);
  if (info.atlas) json["atlas"] = json_of(*info.atlas, info);
  if (!info.regions.empty()) json["each_region"] = to_json(std::span(info.regions));
  return json;
}

}  // namespace vantage
