#include "world_bundles.hpp"

#include <fmt/format.h>

#include "support/plugins.hpp"
#include "vantage/build/bundle_build.hpp"

namespace vantage::benchmarks {

Result<Config> config_of(const NamedMap& map, const std::string& matcher,
                         const std::string& localizer, const std::filesystem::path& bundle) {
  const std::string selector = map.selector.empty() ? "" : "[selector]\n" + map.selector + "\n";
  VANTAGE_TRY(const Table table,
              parse_toml(fmt::format(R"(schema = 1
[map]
files = ["map.pcd"]
[partitioner]
{}
[ground]
plugin = "pmf"
[viewpoints]
voxel_size = {:.1f}
sensor_height = 1.0
[visibility]
{}
[store]
plugin = "pcd_tiles"
content = "{}"
params = {{ root = "{}", overwrite = true }}
{}[matcher]
plugin = "{}"
[localizer]
{}
)",
                                     map.partitioner, map.viewpoint_spacing, map.visibility,
                                     map.content, bundle.string(), selector, matcher, localizer),
                         "the benchmark"));
  return parse_config(table);
}

Result<Bundle> WorldBundles::open(const simulation::WorldParams& params, const NamedMap& map,
                                  const MapDifference& difference) {
  simulation::WorldParams key;
  key.seed = params.seed;
  key.campus = params.campus;
  key.map = params.map;
  key.drive.route = params.drive.route;  // of a survey
  auto& world = worlds_[simulation::to_world_file(key) + difference.key()];
  if (!world) {
    world = std::make_unique<OfWorld>();
    VANTAGE_TRY(world->map, map_of(key, difference));
  }
  const std::filesystem::path place = world->folder.path() / map.name;
  const PluginLoader plugins = test::built_plugins();
  if (!std::filesystem::exists(place)) {
    // Points are the same for all matchers; only ndt prepares maps.
    VANTAGE_TRY(const Config config, config_of(map, "ndt", localizer_, place));
    VANTAGE_TRY(BundleBuild build, BundleBuild::prepare(config, plugins));
    VANTAGE_CHECK(build.run(world->map, {}));
  }
  return Bundle::open(place, plugins);
}

}  // namespace vantage::benchmarks
