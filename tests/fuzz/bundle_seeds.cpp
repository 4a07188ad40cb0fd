#include "bundle_seeds.hpp"

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "build/parts.hpp"
#include "build/plan_file.hpp"
#include "bundle_targets.hpp"
#include "common/packed_index.hpp"
#include "common/partial_folder.hpp"
#include "pcd_tiles/format.hpp"
#include "support/bundles.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/tiling.hpp"

namespace vantage::test::seeds {
namespace {

namespace fs = std::filesystem;
using bundle_folder::RegionFile, bundle_targets::RegionCounts, pcd_tiles::kFormat;

std::string content_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

template <class T>
T value_of(Result<T> result) {
  if (!result) throw std::runtime_error(to_string(result.error()));
  return *std::move(result);
}

template <class T>
std::string raw(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}
std::string sized(const std::string& bytes) {
  return raw(static_cast<std::uint32_t>(bytes.size())) + bytes;
}
std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Partition partition() {
  return value_of(Partition::from(
      {{"r0", HalfOpenBox{{0.0, 0.0}, {10.0, 10.0}}, {}},
       {"r1", ConvexPolygon{{{10.0, 0.0}, {20.0, 0.0}, {20.0, 10.0}}}, {-1.0, 4.0}},
       {"r2", BoxUnion{{{{0.0, 10.0}, {5.0, 20.0}}, {{5.0, 12.0}, {9.0, 20.0}}}}, {}}}));
}

/// Regions of every sort; they overlap.
std::vector<RegionMap> maps() {
  PointCloud all;
  for (int k = 0; k < 40; ++k) all.emplace_back(k % 20 - 5, k / 2 - 3, 0.25 * k);
  RegionMap first{.points = all, .viewpoints = {{1, 2, 3}, {4, 5, 6}}, .prepared = {}};
  RegionMap second{.points = {all.begin() + 10, all.begin() + 31},
                   .viewpoints = {{1, 2, 3}},
                   .prepared = {.bytes = std::vector<std::byte>(13, std::byte{7}), .elements = 3}};
  RegionMap third{.points = {all[39], all[0], all[0], all[7]}, .viewpoints = {}, .prepared = {}};
  for (std::uint32_t k = 0; k < second.points.size(); ++k) second.views.push_back(1 + 20 * k);
  third.views = {1, 70'000, 3, 4};
  return {first, second, third};
}

/// A bundle of `store`, and what its index says of the regions.
class Bundle {
 public:
  explicit Bundle(const std::string& store) {
    const auto opened = plugin<MapStore>(store, "root = '" + root().string() + "'");
    MapIndex index;
    index.partition = partition();
    index.map_bounds = {Point(-5, -3, 0), Point(15, 17, 10)};
    index.map_points = 40;
    index.config = "schema = 1\n# \"quoted\"\n";
    write_bundle(opened, index, maps());
    bundle_folder::BundleFormat format{.store = store, .version = 4, .extension = ".region"};
    if (store == kFormat.store) format = kFormat;
    const auto bundle = value_of(bundle_folder::open_index(format, root()));
    for (const auto& region : value_of(bundle.regions.all())) files.push_back(region.file);
  }
  [[nodiscard]] fs::path root() const { return folder_.path() / "bundle"; }
  [[nodiscard]] std::string index_text() const { return content_of(root() / "index.json"); }
  [[nodiscard]] std::string file(std::uint32_t region, const std::string& extension) const {
    return content_of(root() / ("r" + std::to_string(region) + extension));
  }
  std::vector<RegionFile> files;

 private:
  TemporaryFolder folder_;
};

std::string counts_of(const RegionFile& file) {
  return raw(RegionCounts{.points = file.points,
                          .viewpoints = file.viewpoints,
                          .elements = file.elements,
                          .prepared_bytes = file.prepared_bytes,
                          .origin = {file.origin.x(), file.origin.y(), file.origin.z()},
                          .max_views = file.max_views});
}

}  // namespace

std::vector<std::string> bundle_index() { return {Bundle("pcd_tiles").index_text()}; }

std::vector<std::string> bundle_regions() {
  std::vector<std::string> files;
  for (const std::uint32_t count : {3U, 150U}) {
    std::vector<Region> regions;
    std::vector<RegionFile> about;
    for (std::uint32_t r = 0; r < count; ++r) {
      Region region = partition()[RegionId{r % 3}];
      region.label = "r" + std::to_string(r);
      regions.push_back(std::move(region));
      RegionFile file{.points = r, .viewpoints = 2, .checksum = 77};
      if (r % 2 == 1) file.max_views = r;
      file.bytes = pcd_tiles::file_size(file);
      about.push_back(file);
    }
    std::string bytes;
    (void)value_of(bundle_folder::write_packed(kFormat, regions, about,
                                               [&](std::string_view more) -> Result<void> {
                                                 bytes += more;
                                                 return {};
                                               }));
    files.push_back(std::move(bytes));
  }
  return files;
}

std::vector<std::string> build_plan() {
  BuildPlan plan;
  plan.partition = partition();
  plan.viewpoints = {{{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}}, {}, {{2.0, 11.0, 1.7}}};
  plan.owned = {30, 7, 3};
  plan.limits = {.map_bounds = {{-5.0, -3.0, 0.0}, {15.0, 17.0, 10.0}}, .max_range = 60.0};
  plan.map_points = 40;
  plan.ground_points = 20;
  plan.place_index = {std::byte{0}, std::byte{7}, std::byte{255}};
  std::string bytes = text_of(encode_plan(plan, bundle_targets::kFuzzedBuild));
  bytes.resize(bytes.size() - sizeof(std::uint64_t));  // the target puts its own checksum there
  return {bytes};
}

std::vector<std::string> build_parts() {
  const TemporaryFolder folder;
  {
    PartWriter writer =
        value_of(PartWriter::create(folder.path(), {1, 1}, bundle_targets::kFuzzedKey));
    for (const std::uint32_t r : {2U, 0U, 1U, 7U}) {
      StoredPart part;
      BuiltRegion& region = part.region;
      region.seen = 50;
      region.skipped = r;
      region.points = 20 * r;
      for (std::uint64_t k = 0; k < region.points; ++k) part.ranks.push_back(k * k * k * r);
      if (r == 2) region.stored.views.assign(part.ranks.size(), 200);
      region.prepared = {.bytes = std::vector<std::byte>(r, std::byte{9}), .elements = r};
      region.errors = {{{1.0, 2.0, 3.0}, 0.02F, 0.01F}};
      done(writer.add(r, part));
    }
    done(std::move(writer).finish());
  }
  return {content_of(folder.path() / "shard_1_of_1.parts")};
}

std::vector<std::string> tiled_map() {
  std::vector<std::string> maps;
  for (const auto precision : {io::Precision::float32, io::Precision::float64}) {
    const TemporaryFolder folder;
    PointCloud points;
    for (int k = 0; k < 30; ++k) points.emplace_back(4.0 * k - 40.0, 3.0 * (k % 7) - 9.0, 0.5 * k);
    if (precision == io::Precision::float64) points.emplace_back(500'000.1, 4'000'000.3, 7.0);
    done(io::write_pcd(folder.path() / "a.pcd", points, precision));
    const std::vector<fs::path> files{folder.path() / "a.pcd"};
    (void)value_of(io::tile_clouds(files, {.out = folder.path() / "map", .tile_size = 20.0}));
    maps.push_back(sized(content_of(folder.path() / "map" / "index.vtiles")) +
                   sized(content_of(folder.path() / "map" / "points_0000.pack")));
  }
  return maps;
}

std::vector<std::string> shared_region() {
  const Bundle bundle("shared_tiles");
  const std::string tiles = content_of(bundle.root() / "tiles.bin");
  std::vector<std::string> regions;
  for (std::uint32_t r = 0; r < bundle.files.size(); ++r) {
    regions.push_back(counts_of(bundle.files[r]) + sized(bundle.file(r, ".region")) + tiles);
  }
  return regions;
}

std::vector<std::string> pcd_region() {
  const Bundle bundle("pcd_tiles");
  std::vector<std::string> regions;
  for (std::uint32_t r = 0; r < bundle.files.size(); ++r) {
    regions.push_back(counts_of(bundle.files[r]) + bundle.file(r, ".pcd"));
  }
  return regions;
}

}  // namespace vantage::test::seeds
