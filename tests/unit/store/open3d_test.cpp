// That other programs read the files of a bundle is tried with one of them.
#include <doctest/doctest.h>
#include <open3d/io/PointCloudIO.h>

#include <string>

#include "support/bundles.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"

namespace vantage {
namespace {

TEST_CASE("Open3D reads the points of a region's file, with views and with more behind them") {
  const PointCloud points{{1.5, 2, 3}, {2, 4, -5}, {2.25, 3, -1}};
  const PreparedMap prepared{std::vector<std::byte>(1001, std::byte{7}), 5};
  const RegionMap maps[] = {
      {points, {}, {}}, {points, {{1, 2, 3}, {2, 3, 4}}, prepared}, {points, {}, {}, {1, 2, 3}}};
  for (const RegionMap& map : maps) {
    const test::TemporaryFolder folder;
    const auto store =
        test::plugin<MapStore>("pcd_tiles", "root = '" + (folder.path() / "bundle").string() + "'");
    MapIndex index;
    index.partition = Partition::from({{"map", HalfOpenBox{{0, 0}, {9, 9}}, {}}}).value();
    test::write_bundle(store, index, {map});

    open3d::geometry::PointCloud read;
    REQUIRE(open3d::io::ReadPointCloud((folder.path() / "bundle" / "map.pcd").string(), read));
    REQUIRE(read.points_.size() == points.size());
    const Point origin(2, 3, -1);
    for (std::size_t i = 0; i < points.size(); ++i) CHECK(read.points_[i] + origin == points[i]);
  }
}

}  // namespace
}  // namespace vantage
