#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "common/partial_folder.hpp"
#include "support/bundles.hpp"
#include "support/plugins.hpp"

/// What the tests of stores put into bundles, and how they look at them.
namespace vantage::store_samples {

namespace fs = std::filesystem;
using test::begun, test::commit, test::finish, test::index_in, test::map_in, test::opened,
    test::write_bundle;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline PointCloud random_cloud(std::size_t n, const Point& centre, double extent,
                               unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> offset(-extent / 2, extent / 2);
  PointCloud cloud;
  for (std::size_t k = 0; k < n; ++k) {
    cloud.push_back(centre + Point(offset(random), offset(random), offset(random)));
  }
  return cloud;
}

/// Three regions of every sort, with edges that no short decimal hits.
inline MapIndex sample_index() {
  auto partition = Partition::from(
      {{"x+000_y+000", HalfOpenBox{{0.1 + 0.2, -1.0 / 3.0}, {1e6 + 0.1, 5e6 + 1e-9}}, {}},
       {"storey.1", ConvexPolygon{{{0.0, 0.0}, {4.0, 0.1}, {1.0 / 7.0, 4.0}}}, {-2.5, 1.0 / 3.0}},
       {"storey.2", HalfOpenBox{{-5e-324, -1.0}, {1e-300, 1.0}}, {1.0 / 3.0, kInfinity}}});
  REQUIRE_MESSAGE(partition, to_string(partition.error()));
  return {.partition = *std::move(partition),
          .regions = {},
          .map_bounds = {Point(-1.0 / 3.0, 0.1, -0.0), Point(1e6, 5e6 + 0.1, 77.7)},
          .map_points = 123456789,
          .config = "schema = 1\n# \"quoted\" \\ text, ä, \t tab\n"};
}

inline PreparedMap some_prepared(std::size_t bytes, std::uint64_t elements, unsigned seed = 1) {
  std::mt19937 random(seed);
  PreparedMap prepared{.bytes = {}, .elements = elements};
  for (std::size_t i = 0; i < bytes; ++i) {
    prepared.bytes.push_back(static_cast<std::byte>(random() % 256));
  }
  return prepared;
}

inline RegionMap points_alone(PointCloud points) { return {std::move(points), {}, {}}; }

inline std::vector<RegionMap> sample_maps() {
  return {{random_cloud(1000, {5e5, 2e6, 10}, 80.0), random_cloud(7, {5e5, 2e6, 12}, 80.0, 2), {}},
          {},
          {random_cloud(10, {0, 0, 0}, 2.0), random_cloud(3, {0, 0, 1}, 2.0),
           some_prepared(1234, 4'000'000'000U)}};
}

inline PluginPtr<MapStore> pcd_tiles_at(const fs::path& root, bool overwrite = false) {
  return test::plugin<MapStore>(
      "pcd_tiles", "root = '" + root.string() + "'\noverwrite = " + (overwrite ? "true" : "false"));
}

inline std::vector<std::string> files_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

template <class T>
inline void check_fails(const Result<T>& result, ErrorCode code, const std::string& part) {
  REQUIRE(!result.has_value());
  const std::string text = to_string(result.error());
  CHECK_MESSAGE(result.error().code == code, text);
  CHECK_MESSAGE(text.find(part) != std::string::npos, text);
}

/// Changes what a bundle says of its regions, and puts all checksums right.
/// @param change  gets what was there, by RegionId: std::vector<IndexedRegion>&
template <class Change>
inline void forge_regions(const bundle_folder::BundleFormat& format, const fs::path& root,
                          const Change& change) {
  using namespace bundle_folder;  // NOLINT(google-build-using-namespace)
  auto opened = open_index(format, root);
  REQUIRE_MESSAGE(opened, to_string(opened.error()));
  auto all = opened->regions.all();
  REQUIRE_MESSAGE(all, to_string(all.error()));
  change(*all);
  std::vector<Region> regions;
  std::vector<RegionFile> files;
  for (const IndexedRegion& one : *all) {
    regions.push_back(one.region);
    files.push_back(one.file);
  }
  std::string bytes;
  opened->head.regions = write_packed(format, regions, files, [&](std::string_view more) {
                           bytes += more;
                           return Result<void>();
                         }).value();
  std::ofstream(root / kRegionsFile, std::ios::binary) << bytes;
  std::ofstream(root / kIndex, std::ios::binary) << to_json(format, opened->head).value();
}

/// Replaces the first occurrence; ends the test if there is none.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE_MESSAGE(at != std::string::npos, from);
  return text.replace(at, from.size(), to);
}

/// The greatest difference of a coordinate.
inline double worst(const PointCloud& a, const PointCloud& b) {
  REQUIRE(a.size() == b.size());
  double error = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    error = std::max(error, (a[k] - b[k]).cwiseAbs().maxCoeff());
  }
  return error;
}

}  // namespace vantage::store_samples
