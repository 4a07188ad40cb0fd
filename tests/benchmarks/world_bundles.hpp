#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "simulate/params.hpp"
#include "support/real_data.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"
#include "world_maps.hpp"

namespace vantage::benchmarks {

/// How a map is cut, selected and stored: lines of the tables of a configuration.
struct NamedMap {
  std::string name;
  std::string partitioner;  ///< lines of [partitioner]
  std::string visibility;   ///< lines of [visibility]
  std::string content = "points";
  double viewpoint_spacing = 2.0;  ///< [m]
  std::string selector = {};       ///< lines of [selector]; without them, all elements are kept
};
inline constexpr const char* kWholeMap = "plugin = \"whole_map\"";
inline constexpr const char* kRegionsOf20m =
    "plugin = \"uniform_grid\"\nparams = { cell_width = 20.0 }";

/// @param localizer  lines of [localizer]
/// @param bundle     where the bundle is
[[nodiscard]] Result<Config> config_of(const NamedMap& map, const std::string& matcher,
                                       const std::string& localizer,
                                       const std::filesystem::path& bundle);

/// The bundles of simulated worlds in temporary folders, each built when it is first asked for.
/// Worlds with the same map share its bundles.
class WorldBundles {
 public:
  /// @param localizer  lines of [localizer]
  explicit WorldBundles(std::string localizer) : localizer_(std::move(localizer)) {}

  /// Errors: those of World, of the build and of Bundle::open.
  [[nodiscard]] Result<Bundle> open(const simulation::WorldParams& params, const NamedMap& map,
                                    const MapDifference& difference = {});

 private:
  struct OfWorld {
    PointCloud map;
    test::TemporaryFolder folder;
  };
  std::string localizer_;
  std::map<std::string, std::unique_ptr<OfWorld>> worlds_;
};

}  // namespace vantage::benchmarks
