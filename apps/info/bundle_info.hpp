#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "terminal/style.hpp"
#include "vantage/engine/atlas.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/engine/predicted_errors.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The files of a folder that have one ending.
struct FileGroup {
  std::string name;  ///< of the only one; of several, their ending
  std::uint64_t count = 0, bytes = 0;
};

/// What a bundle contains, without its points.
struct BundleInfo {
  std::filesystem::path path;
  std::uint64_t bytes = 0;
  std::vector<FileGroup> files;  ///< the largest first
  BundleSummary summary;
  std::string matcher;                       ///< for which maps are prepared; empty if not known
  std::optional<PluginChoice> relocalizer;   ///< that made the index of places, if there is one
  std::optional<Atlas> atlas;                ///< none if it was not assessed
  std::optional<PredictedErrors> predicted;  ///< none if no selector chose elements
  std::optional<double> target_error;        ///< of the selector [m]
  std::map<RegionId, std::string> labels;    ///< of the regions that are named
  std::vector<DirectoryEntry> regions;       ///< all, by RegionId; none if not asked for

  [[nodiscard]] const std::string& label_of(RegionId region) const { return labels.at(region); }
};

/// The bundle in a folder; none if the path is something else.
/// @param each_region  whether `regions` is asked for
/// Errors: those of Bundle::open except `not_found`; those of Atlas::of_bundle; those of reading a
/// region.
[[nodiscard]] Result<std::optional<BundleInfo>> inspect_bundle(const std::filesystem::path& path,
                                                               const PluginLoader& plugins,
                                                               bool each_region = false);

[[nodiscard]] std::string to_text(const BundleInfo& info, const cli::Style& style);
[[nodiscard]] nlohmann::ordered_json to_json(const BundleInfo& info);

}  // namespace vantage
