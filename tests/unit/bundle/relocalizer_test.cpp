// Which relocalizer searches a bundle, and what becomes of an index that it cannot read.
#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <string>

#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/build/bundle_build.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/localizer.hpp"

using namespace vantage;

namespace {

/// The plugins of the project, and the relocalizer `columns` of a third party.
PluginLoader with_columns() {
  auto folders = test::built_plugins().folders();
  folders.emplace_back(OTHER_RELOCALIZER_DIR);
  return PluginLoader(folders);
}

/// Walls at random on level ground of 60 m, dense enough for `ndt`.
PointCloud yard() {
  std::mt19937 random(3);
  const auto number = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random() % 100000) / 1e5;
  };
  constexpr double kStep = 0.3;
  PointCloud map;
  for (int i = 0; i < 200; ++i) {
    for (int j = 0; j < 200; ++j) map.emplace_back(kStep * i, kStep * j, 0.01 * ((i + j) % 3));
  }
  for (int wall = 0; wall < 40; ++wall) {
    const Point foot(number(0, 60), number(0, 60), 0.0);
    const double angle = number(0, 3.14), length = number(1, 9), height = number(2, 6);
    for (double along = 0.0; along < length; along += kStep) {
      for (double z = kStep; z < height; z += kStep) {
        map.push_back(foot + Point(along * std::cos(angle), along * std::sin(angle), z));
      }
    }
  }
  return map;
}

const std::string kConfig = R"(schema = 1
[partitioner]
plugin = "whole_map"
[ground]
plugin = "pmf"
[viewpoints]
voxel_size = 10.0
[visibility]
plugin = "keep_all"
[store]
plugin = "pcd_tiles"
params = { root = "bundle" }
[matcher]
plugin = "ndt"
)";

class World {
 public:
  explicit World(const std::vector<std::string>& overrides) {
    test::write_text(folder_.path() / "map.toml", kConfig);
    auto build = BundleBuild::prepare(config(overrides), with_columns());
    REQUIRE_MESSAGE(build, to_string(build.error()));
    const auto report = build->run(map_, {});
    REQUIRE_MESSAGE(report, to_string(report.error()));
  }

  [[nodiscard]] Config config(const std::vector<std::string>& overrides) const {
    return load_config(folder_.path() / "map.toml", overrides).value();
  }
  [[nodiscard]] std::string indexed_by() const {
    const auto bundle = Bundle::open(folder_.path() / "bundle", test::built_plugins()).value();
    const auto maker = bundle.indexed_by().value();
    return maker ? maker->plugin : "nothing";
  }
  [[nodiscard]] Result<Localizer> open(const std::vector<std::string>& overrides) const {
    return Localizer::open(config(overrides), with_columns());
  }
  /// Whether a sensor that may be anywhere is found.
  [[nodiscard]] bool finds(const std::vector<std::string>& overrides) const {
    auto localizer = open(overrides);
    REQUIRE_MESSAGE(localizer, to_string(localizer.error()));
    localizer->start_anywhere();
    const Pose truth = pose_from_xyz_rpy({30.3, 40.2, 1.5}, {0.0, 0.0, 0.7});
    PointCloud scan;
    for (const Point& p : map_) scan.push_back(truth.inverse() * p);
    const auto report = localizer->localize({.stamp = 0.0, .points = scan});
    REQUIRE_MESSAGE(report, to_string(report.error()));
    return report->has_pose && (report->T_map_scan.translation - truth.translation).norm() < 0.3;
  }

 private:
  test::TemporaryFolder folder_;
  PointCloud map_ = yard();
};

}  // namespace

TEST_CASE("a bundle says which relocalizer made its index, and a run takes this one") {
  const World usual({"store.content=prepared"});
  CHECK(usual.indexed_by() == "voxel_search");
  CHECK(usual.finds({}));
  const World other({"store.content=prepared", "relocalizer.plugin=columns"});
  CHECK(other.indexed_by() == "columns");
  CHECK(other.finds({}));
  CHECK(other.finds({"relocalizer.plugin=columns"}));
}

TEST_CASE("another relocalizer makes its index from a bundle's points") {
  const World world({"store.content=points"});
  CHECK(world.finds({"relocalizer.plugin=columns"}));
  CHECK(world.indexed_by() == "voxel_search");  // the bundle stays as it is
}

TEST_CASE("without points, another relocalizer is refused at opening") {
  const World world({"store.content=prepared"});
  const auto refused = world.open({"relocalizer.plugin=columns"});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == ErrorCode::invalid_config);
  CHECK(refused.error().message ==
        "[relocalizer] plugin = \"columns\" cannot read the bundle's index of places, which "
        "'voxel_search' made; there are no points to make another one from: name that plugin with "
        "its parameters, or build the bundle again");
}

TEST_CASE("whether other parameters matter to the index, the relocalizer says") {
  const World world({"store.content=prepared", "relocalizer.plugin=columns"});
  const std::string columns = "relocalizer.plugin=columns";
  CHECK(world.finds({columns, "relocalizer.params.height=1.2"}));
  const auto refused = world.open({columns, "relocalizer.params.cell=0.5"});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == ErrorCode::invalid_config);
  CHECK(refused.error().message.find("which 'columns' made: the index has cells of 1.0") !=
        std::string::npos);
}

TEST_CASE("a relocalizer that is not installed, or a parameter that it has not, is named") {
  const World world({"store.content=points"});
  const auto unknown = world.open({"relocalizer.plugin=voxel_serch"});
  REQUIRE_FALSE(unknown.has_value());
  CHECK(unknown.error().message.find("did you mean 'voxel_search'?") != std::string::npos);
  const auto wrong = world.open({"relocalizer.plugin=columns", "relocalizer.params.cel=1.0"});
  REQUIRE_FALSE(wrong.has_value());
  CHECK(wrong.error().message.find("did you mean 'cell'?") != std::string::npos);
}
