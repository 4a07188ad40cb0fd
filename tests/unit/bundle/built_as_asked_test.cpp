// Which keys of a configuration must be those of the bundle that it names.
#include <doctest/doctest.h>

#include <filesystem>
#include <string>

#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/build/bundle_build.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/localizer.hpp"

using namespace vantage;

namespace {

const std::string kBuilt = R"(schema = 1
[map]
files = ["map.pcd"]
trajectory = "drive.tum"
[partitioner]
plugin = "uniform_grid"
params = { cell_width = 20 }
[ground]
plugin = "pmf"
[viewpoints]
voxel_size = 5.0
height_offsets = [0.0, 0.5]
[visibility]
plugin = "hpr"
max_range = 30.0
params = { alpha = 100.0 }
[store]
plugin = "pcd_tiles"
params = { root = "bundle" }
[matcher]
plugin = "ndt"
)";

const std::string kNoContent = "store.content";  // instead of an override: the build decides

/// A map of 40 m x 40 m and the bundle that `kBuilt` makes of it, with points.
class Built {
 public:
  explicit Built(std::vector<std::string> overrides = {}) {
    PointCloud map;
    for (int i = 0; i < 80; ++i) {
      for (int j = 0; j < 80; ++j) map.emplace_back(0.5 * i, 0.5 * j, 0.01 * (i % 3));
      for (int k = 1; k < 8; ++k) map.emplace_back(0.5 * i, 20.0, 0.5 * k);
    }
    const PointCloud drive{{1, 10, 1}, {20, 10, 1}, {39, 10, 1}};
    test::write_text(folder_.path() / "built.toml", kBuilt);
    if (std::ranges::find(overrides, kNoContent) == overrides.end()) {
      overrides.insert(overrides.begin(), "store.content=points");
    }
    std::erase(overrides, kNoContent);
    const auto config = load_config(folder_.path() / "built.toml", overrides);
    REQUIRE_MESSAGE(config, to_string(config.error()));
    auto build = BundleBuild::prepare(*config, test::built_plugins());
    REQUIRE_MESSAGE(build, to_string(build.error()));
    const auto report = build->run(map, drive);
    REQUIRE_MESSAGE(report, to_string(report.error()));
  }

  /// The error without its place, or "" if the bundle is opened.
  [[nodiscard]] std::string open(const std::string& toml,
                                 const std::vector<std::string>& overrides = {},
                                 const PluginLoader& plugins = test::built_plugins()) const {
    test::write_text(folder_.path() / "asked.toml", toml);
    const auto config = load_config(folder_.path() / "asked.toml", overrides);
    REQUIRE_MESSAGE(config, to_string(config.error()));
    const auto bundle = Bundle::open(*config, plugins, "localization");
    if (bundle) return "";
    CHECK(bundle.error().code == ErrorCode::invalid_config);
    CHECK(bundle.error().where.has_value());
    return bundle.error().message;
  }
  [[nodiscard]] std::filesystem::path path(const std::string& name) const {
    return folder_.path() / name;
  }

 private:
  test::TemporaryFolder folder_;
};

std::string otherwise(const std::string& key, const std::string& asked, const std::string& built) {
  return "'" + key + "' is " + asked + ", and the bundle was built " +
         (built.empty() ? "without it" : "with " + built) +
         ": build the bundle again, or change the key to match it";
}

}  // namespace

TEST_CASE("keys that decide what a bundle holds must be those that it was built with") {
  const Built built;
  const auto asked = [&](const std::string& set) { return built.open(kBuilt, {set}); };
  CHECK(built.open(kBuilt).empty());
  CHECK(asked("visibility.max_range=15") == otherwise("visibility.max_range", "15.0", "30.0"));
  CHECK(asked("visibility.scope=region") == otherwise("visibility.scope", "\"region\"", "\"map\""));
  CHECK(asked("visibility.params.alpha=10") == otherwise("visibility.params.alpha", "10", "100.0"));
  CHECK(asked("visibility.min_views=2") == otherwise("visibility.min_views", "2", "1"));
  CHECK(asked("viewpoints.height_offsets=[0.0, 0.6]") ==
        otherwise("viewpoints.height_offsets", "[0.0, 0.6]", "[0.0, 0.5]"));
  CHECK(asked("viewpoints.height_offsets=[0.0]") ==
        otherwise("viewpoints.height_offsets", "[0.0]", "[0.0, 0.5]"));
  CHECK(asked("viewpoints.source=trajectory") ==
        otherwise("viewpoints.source", "\"trajectory\"", "\"ground\""));
  CHECK(asked("thinning.voxel_size=0.5") == otherwise("thinning.voxel_size", "0.5", ""));
  CHECK(asked("partitioner.params.cell_width=40") ==
        otherwise("partitioner.params.cell_width", "40", "20.0"));
  CHECK(asked("ground.plugin=smrf") == otherwise("ground.plugin", "\"smrf\"", "\"pmf\""));
  CHECK(asked("store.content=prepared") ==
        otherwise("store.content", "\"prepared\"", "\"points\""));
  CHECK(asked("store.views=true") == otherwise("store.views", "true", "false"));
  CHECK(built.open(kBuilt, {"visibility.max_range=15", "viewpoints.voxel_size=4",
                            "partitioner.params.cell_width=40"}) ==
        otherwise("partitioner.params.cell_width", "40", "20.0") +
            "; also different: 'viewpoints.voxel_size', 'visibility.max_range'");
}

TEST_CASE("what does not change a bundle may differ, and what is left out is not asked for") {
  const Built built;
  const auto asked = [&](const std::string& set) { return built.open(kBuilt, {set}); };
  CHECK(asked("matcher.params.resolution=2").empty());
  CHECK(asked("matcher.plugin=icp").empty());
  CHECK(asked("localizer.scan_voxel_size=0.1").empty());
  CHECK(asked("map.files=[\"elsewhere/map.pcd\"]").empty());
  CHECK(asked("map.trajectory=elsewhere.tum").empty());
  CHECK(asked("store.params.overwrite=true").empty());
  CHECK(asked("visibility.library=" VANTAGE_PLUGIN_DIR "/vantage_visibility_hpr.so").empty());
  // 20 and 20.0, and defaults that are written down.
  CHECK(asked("partitioner.params.cell_width=20.0").empty());
  CHECK(asked("viewpoints.min_gain=0").empty());
  CHECK(asked("store.content=points").empty());

  const std::string store = "[store]\nplugin = \"pcd_tiles\"\nparams = { root = \"bundle\" }\n";
  CHECK(built.open("schema = 1\n" + store).empty());
  CHECK(built.open("schema = 1\n[visibility]\nplugin = \"hpr\"\nparams = {alpha = 100.0}\n" + store)
            .empty());
  CHECK(built.open("schema = 1\n[visibility]\nplugin = \"keep_all\"\n" + store) ==
        otherwise("visibility.plugin", "\"keep_all\"", "\"hpr\""));

  // A robot needs neither the partitioner nor the operator; numbers are compared all the same.
  const test::TemporaryFolder plugins;
  const auto copy = [&](const std::string& name) {
    std::filesystem::copy_file(std::filesystem::path(VANTAGE_PLUGIN_DIR) / name,
                               plugins.path() / name);
  };
  copy("vantage_store_pcd_tiles.so");
  const PluginLoader robot({plugins.path()});
  CHECK(built.open(kBuilt, {}, robot).empty());
  CHECK(built.open(kBuilt, {"partitioner.params.cell_width=40"}, robot) ==
        otherwise("partitioner.params.cell_width", "40", "20.0"));
}

TEST_CASE("a configuration that a program made asks for all that it holds") {
  const Built built;
  test::write_text(built.path("asked.toml"), kBuilt);
  Config config = load_config(built.path("asked.toml")).value();
  config.written = {};
  CHECK(Bundle::open(config, test::built_plugins(), "localization"));
  Config robot;  // says nothing of how the bundle was built
  robot.store = config.store;
  CHECK(Bundle::open(robot, test::built_plugins(), "localization"));
  config.visibility->max_range = 15.0;
  const auto refused = Bundle::open(config, test::built_plugins(), "localization");
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message == otherwise("visibility.max_range", "15.0", "30.0"));
  CHECK(refused.error().where->file == config.file);
}

TEST_CASE("viewpoints along a trajectory: [ground] is not part of the bundle") {
  const Built built({"viewpoints.source=trajectory"});
  CHECK(built.open(kBuilt, {"viewpoints.source=trajectory"}).empty());
  CHECK(built.open(kBuilt, {"viewpoints.source=trajectory", "ground.plugin=smrf"}).empty());
  CHECK(built.open(kBuilt).empty());  // the source is left out
  CHECK(built.open(kBuilt, {"viewpoints.source=ground"}) ==
        otherwise("viewpoints.source", "\"ground\"", "\"trajectory\""));
}

TEST_CASE("maps prepared for another matcher are refused at opening") {
  const Built built({"store.content=prepared"});
  test::write_text(built.path("asked.toml"), kBuilt);
  const auto opened = [&](const std::vector<std::string>& overrides) {
    const Config config = load_config(built.path("asked.toml"), overrides).value();
    return Localizer::open(config, test::built_plugins());
  };
  CHECK(opened({"store.content=prepared"}));
  for (const std::string matcher : {"gicp", "icp"}) {
    CAPTURE(matcher);
    const auto refused = opened({"store.content=prepared", "matcher.plugin=" + matcher});
    REQUIRE_FALSE(refused.has_value());
    CHECK(refused.error().code == ErrorCode::invalid_config);
    CHECK(refused.error().where->file == built.path("asked.toml"));
    CHECK(to_string(refused.error()) ==
          built.path("asked.toml").string() +
              ": error: the bundle holds maps prepared for 'ndt', which this matcher cannot use: "
              "the stored map of surfels is damaged: it does not begin with VSFL; another matcher "
              "may have made it; expected the matcher that the bundle was built with, or a bundle "
              "with store.content = \"points\" (while opening the bundle)");
  }
  // The same matcher with parameters for which nothing was prepared.
  const auto other = opened({"store.content=prepared", "matcher.params.resolution=3"});
  REQUIRE_FALSE(other.has_value());
  CHECK(other.error().code == ErrorCode::invalid_config);
}

TEST_CASE("a bundle that keeps the prepared form says so") {
  const Built built({"store.content=prepared"});
  CHECK(built.open(kBuilt).empty());
  CHECK(built.open(kBuilt, {"store.content=prepared"}).empty());
  CHECK(built.open(kBuilt, {"store.content=both"}) ==
        otherwise("store.content", "\"both\"", "\"prepared\""));
}

TEST_CASE("what a bundle stores if that is left out: what is asked for loses nothing") {
  const std::vector<std::string> select{kNoContent, "selector.plugin=contribution",
                                        "selector.share=0.5"};
  const auto with = [&](const std::string& one) {
    auto overrides = select;
    overrides.push_back(one);
    return overrides;
  };
  const auto stored = [](const Built& built) {
    const auto bundle = Bundle::open(built.path("bundle"), test::built_plugins()).value();
    bool points = false, prepared = false, views = false;
    for (std::uint32_t r = 0; r < bundle.directory()->summary().regions; ++r) {
      const RegionMap map = bundle.get(RegionId{r}).value();
      points = points || !map.points.empty();
      prepared = prepared || !map.prepared.bytes.empty();
      views = views || !map.views.empty();
    }
    return std::string(points ? "points " : "") + (prepared ? "prepared " : "") +
           (views ? "views " : "");
  };
  CHECK(stored(Built({kNoContent})) == "prepared ");
  CHECK(stored(Built({kNoContent, "store.views=true"})) == "points views ");
  CHECK(stored(Built(select)) == "prepared ");
  CHECK(stored(Built(with("store.views=true"))) == "points prepared views ");
  CHECK(stored(Built(with("thinning.voxel_size=2"))) == "points prepared ");
}

TEST_CASE("the engine decides what a bundle keeps of its configuration") {
  const Built points, prepared({"store.content=prepared", "localizer.switch_margin=1"});
  const auto kept = [](const Built& built) {
    return Bundle::open(built.path("bundle"), test::built_plugins()).value().built_with().value();
  };
  const Config of_points = kept(points), of_prepared = kept(prepared);
  CHECK_FALSE(of_points.store.has_value());
  CHECK_FALSE(of_points.matcher.has_value());
  CHECK_FALSE(of_points.localizer.has_value());
  REQUIRE(of_points.viewpoints.has_value());
  CHECK(of_points.viewpoints->voxel_size == 5.0);
  CHECK(of_points.partitioner->params.find("cell_width") != nullptr);
  CHECK(of_points.ground->params.entries.size() > 1);  // the plugin's defaults
  REQUIRE(of_prepared.matcher.has_value());
  CHECK(of_prepared.matcher->plugin == "ndt");
  CHECK_FALSE(of_prepared.localizer.has_value());
}
