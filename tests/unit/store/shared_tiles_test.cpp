#include <doctest/doctest.h>

#include <cstring>
#include <thread>

#include "store_samples.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/kit/canonical_order.hpp"
#include "vantage/kit/checksum.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::read_text, test::write_text;
using namespace store_samples;  // NOLINT(google-build-using-namespace)

PluginPtr<MapStore> shared_store_at(const fs::path& root, const std::string& more = {}) {
  return test::plugin<MapStore>("shared_tiles", "root = '" + root.string() + "'\n" + more);
}

/// Regions side by side, of any number.
MapIndex index_of_regions(std::size_t count) {
  std::vector<Region> regions;
  for (std::size_t r = 0; r < count; ++r) {
    const auto x = static_cast<double>(r);
    regions.push_back({"r" + std::to_string(r), HalfOpenBox{{x, 0}, {x + 1, 1}}, {}});
  }
  MapIndex index;
  index.partition = Partition::from(std::move(regions)).value();
  return index;
}

/// Points that float32 holds exactly in any tile; some are equal.
PointCloud lattice_map(std::size_t n, unsigned seed = 1) {
  std::mt19937 random(seed);
  const auto coordinate = [&](std::uint32_t range) {
    return static_cast<double>(random() % range) / 64.0 - 30.0;
  };
  PointCloud map;
  for (std::size_t i = 0; i < n; ++i) {
    map.emplace_back(coordinate(64 * 60), coordinate(64 * 60), coordinate(64 * 4));
    if (i % 50 == 7) map.push_back(map[random() % map.size()]);
  }
  return map;
}

/// Every region sees about half of the map, in the order of the map.
std::vector<RegionMap> views_of_map(const PointCloud& map, std::size_t regions) {
  std::mt19937 random(5);
  std::vector<RegionMap> maps(regions);
  for (RegionMap& seen : maps) {
    bool visible = true;
    for (const Point& p : map) {
      if (random() % 9 == 0) visible = !visible;
      if (visible) seen.points.push_back(p);
    }
    seen.viewpoints = {Point(1, 2, 3)};
  }
  return maps;
}

void check_all(const MapReader& bundle, const std::vector<RegionMap>& maps) {
  for (std::uint32_t r = 0; r < maps.size(); ++r) {
    CAPTURE(r);
    const auto read = bundle.get(RegionId{r});
    REQUIRE_MESSAGE(read, to_string(read.error()));
    CHECK(read->points == maps[r].points);
    CHECK(read->viewpoints == maps[r].viewpoints);
    CHECK(read->views == maps[r].views);
    CHECK(read->prepared == maps[r].prepared);
  }
}

void check_all(const PluginPtr<MapStore>& store, const std::vector<RegionMap>& maps) {
  check_all(*opened(store), maps);
}

void check_same_files(const fs::path& a, const fs::path& b) {
  CHECK(files_in(a) == files_in(b));
  for (const std::string& name : files_in(a)) {
    CHECK_MESSAGE(read_text(a / name) == read_text(b / name), name);
  }
}

TEST_CASE("shared_tiles: a point of many regions is stored once") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "b";
  const PointCloud map = lattice_map(20'000);
  const auto maps = views_of_map(map, 12);
  write_bundle(shared_store_at(root), index_of_regions(12), maps);
  check_all(shared_store_at(root), maps);
  CHECK(fs::file_size(root / "tiles.bin") < 15 * map.size());
  std::vector<std::string> files{"index.json", "regions.idx", "tiles.bin"};
  for (int r = 0; r < 12; ++r) files.push_back("r" + std::to_string(r) + ".region");
  std::sort(files.begin(), files.end());
  CHECK(files_in(root) == files);
  CHECK(files_in(folder.path()) == std::vector<std::string>{"b"});
  const auto index = index_in(shared_store_at(root));
  REQUIRE(index);
  CHECK(index->regions[3].points == maps[3].points.size());
  CHECK(index->regions[3].bytes == fs::file_size(root / "r3.region"));
}

TEST_CASE("shared_tiles: regions of a map in canonical order take little more than the map") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "b";
  PointCloud map = lattice_map(50'000);
  std::ranges::sort(map, canonically_before);
  const auto maps = views_of_map(map, 20);
  write_bundle(shared_store_at(root), index_of_regions(20), maps);
  check_all(shared_store_at(root), maps);
  std::uintmax_t bytes = 0;
  for (const std::string& name : files_in(root)) bytes += fs::file_size(root / name);
  CHECK(bytes < 16 * map.size());  // 12 for the coordinates, and 20 regions
}

TEST_CASE("shared_tiles: any order of points comes back, also if regions contradict each other") {
  const test::TemporaryFolder folder;
  const Point a(1, 0, 0), b(2, 0, 0), c(50, 0, 0), d(-50, 0, 0);
  std::vector<RegionMap> maps;
  for (const PointCloud& points : std::vector<PointCloud>{
           {a, b, c}, {b, a, d}, {c, b, a}, {a, a, b, a}, {b, d, a, a, c, a}, {}, {d, d, d}}) {
    maps.push_back(points_alone(points));
  }
  const PointCloud map = lattice_map(300);
  std::mt19937 random(3);
  for (int r = 0; r < 20; ++r) {
    PointCloud shuffled = map;
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    shuffled.resize(random() % 300);
    maps.push_back(points_alone(shuffled));
  }
  const auto index = index_of_regions(maps.size());
  write_bundle(shared_store_at(folder.path() / "one"), index, maps);
  check_all(shared_store_at(folder.path() / "one"), maps);

  // The bytes do not depend on the order of the puts.
  auto writer = begun(shared_store_at(folder.path() / "two"), index);
  std::vector<std::uint32_t> order(maps.size());
  for (std::uint32_t r = 0; r < order.size(); ++r) order[r] = r;
  std::shuffle(order.begin(), order.end(), random);
  for (const std::uint32_t r : order) REQUIRE(writer->put(RegionId{r}, maps[r]));
  commit(std::move(writer));
  check_same_files(folder.path() / "one", folder.path() / "two");
}

TEST_CASE("shared_tiles: the bytes do not depend on what a build keeps in memory") {
  const test::TemporaryFolder folder;
  const auto maps = views_of_map(lattice_map(5'000), 30);
  const auto index = index_of_regions(maps.size());
  write_bundle(shared_store_at(folder.path() / "one", "tile_width = 7.0"), index, maps);
  write_bundle(shared_store_at(folder.path() / "two", "tile_width = 7.0\nbuild_cache = 0"), index,
               maps);
  check_same_files(folder.path() / "one", folder.path() / "two");
  check_all(shared_store_at(folder.path() / "two"), maps);
}

TEST_CASE("shared_tiles: views and prepared bytes are kept for each region") {
  const test::TemporaryFolder folder;
  const PointCloud map = lattice_map(500);
  auto maps = views_of_map(map, 4);
  const std::uint32_t most[] = {200, 60'000, 4'000'000'000U};
  for (std::size_t r = 0; r < 3; ++r) {
    std::mt19937 random(1);
    for (std::size_t i = 0; i < maps[r].points.size(); ++i) {
      maps[r].views.push_back(1 + static_cast<std::uint32_t>(random() % most[r]));
    }
    maps[r].prepared = some_prepared(1001 + r, 3);
  }
  const fs::path root = folder.path() / "b";
  write_bundle(shared_store_at(root), index_of_regions(4), maps);
  check_all(shared_store_at(root), maps);
}

TEST_CASE("shared_tiles: many threads read one bundle") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "b";
  const auto maps = views_of_map(lattice_map(20'000), 6);
  write_bundle(shared_store_at(root, "tile_width = 3.5"), index_of_regions(6), maps);
  const auto bundle = opened(shared_store_at(root));
  std::vector<int> right(4, 0);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < right.size(); ++t) {
    threads.emplace_back([&, t] {
      for (std::uint32_t k = 0; k < 12; ++k) {
        const auto r = static_cast<std::uint32_t>((k + t) % 6);
        const auto read = bundle->get(RegionId{r});
        right[t] += read && read->points == maps[r].points ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(right == std::vector<int>(4, 12));
}

TEST_CASE("shared_tiles: a bundle that takes another's place is read from its own tiles") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "b";
  const auto before = views_of_map(lattice_map(2'000), 3);
  const auto after = views_of_map(lattice_map(2'000, 9), 3);
  write_bundle(shared_store_at(root), index_of_regions(3), before);
  const auto reader = opened(shared_store_at(root));
  check_all(*reader, before);
  write_bundle(shared_store_at(root, "overwrite = true"), index_of_regions(3), after);
  check_all(shared_store_at(root), after);
  for (const std::uint32_t r : {0U, 1U, 2U}) {
    check_fails(reader->get(RegionId{r}), ErrorCode::io_failure, "another bundle");
  }
  CHECK(files_in(folder.path()) == std::vector<std::string>{"b"});
}

TEST_CASE("shared_tiles: damage is corrupt_data that names the file and the region") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "b";
  const auto maps = views_of_map(lattice_map(3'000), 2);
  write_bundle(shared_store_at(root), index_of_regions(2), maps);
  const auto refused = [&](const std::string& file, const std::string& content,
                           const std::string& reason, const std::string& region) {
    const std::string good = read_text(root / file);
    write_text(root / file, content);
    const auto read = map_in(shared_store_at(root), 1);
    check_fails(read, ErrorCode::corrupt_data, reason);
    check_fails(read, ErrorCode::corrupt_data, (root / file).string());
    check_fails(read, ErrorCode::corrupt_data, region);
    write_text(root / file, good);
  };
  const auto flipped = [](std::string text, std::size_t at) {
    text[at] = static_cast<char>(text[at] ^ 0x10);
    return text;
  };
  const std::string region = read_text(root / "r1.region"), tiles = read_text(root / "tiles.bin");
  for (const std::size_t at : {std::size_t{3}, region.size() / 2, region.size() - 1}) {
    refused("r1.region", flipped(region, at), "checksum", "r1.region");
  }
  refused("r1.region", region.substr(0, region.size() - 8), "bytes, expected", "r1.region");
  refused("r1.region", "", "bytes, expected", "r1.region");
  refused("tiles.bin", flipped(tiles, tiles.size() / 2), "checksum", "region 'r1'");
  refused("tiles.bin", tiles.substr(0, tiles.size() - 8), "but the file ends after", "region 'r1'");
  refused("tiles.bin", "", "but the file ends after", "region 'r1'");
  check_all(shared_store_at(root), maps);
  fs::remove(root / "tiles.bin");
  check_fails(map_in(shared_store_at(root), 0), ErrorCode::corrupt_data, "the file is missing");
  fs::remove(root / "r0.region");
  check_fails(map_in(shared_store_at(root), 0), ErrorCode::corrupt_data, "r0.region");
}

/// The content of a region's file behind its title, for a region without views and prepared bytes.
struct ForgedRegion {
  struct Part {
    std::uint64_t offset, bytes, checksum;
    std::uint32_t count, coding;
    std::uint64_t selection_bytes;
  };
  std::string head;  // to the end of the viewpoints
  std::vector<Part> parts;
  std::string rest;

  explicit ForgedRegion(const std::string& content, std::size_t viewpoints) {
    const std::size_t begin = (32 + 12 * viewpoints + 7) / 8 * 8;
    head = content.substr(0, begin);
    std::uint64_t count = 0;
    std::memcpy(&count, content.data() + begin, 8);
    order_ = content.substr(begin + 8, 8);
    parts.resize(count);
    std::memcpy(parts.data(), content.data() + begin + 16, count * sizeof(Part));
    rest = content.substr(begin + 16 + count * sizeof(Part));
  }
  [[nodiscard]] std::string content() const {
    const std::uint64_t count = parts.size();
    std::string all = head;
    all.append(reinterpret_cast<const char*>(&count), 8);
    all += order_;
    all.append(reinterpret_cast<const char*>(parts.data()), count * sizeof(Part));
    return all + rest;
  }

 private:
  std::string order_;
};
static_assert(sizeof(ForgedRegion::Part) == 40);

/// Puts a region's file into a bundle, with the checksums that it needs.
void forge(const fs::path& root, std::uint32_t region, const std::string& content,
           std::uint64_t points) {
  constexpr bundle_folder::BundleFormat kFormat{
      .store = "shared_tiles", .version = 4, .extension = ".region"};
  forge_regions(kFormat, root, [&](std::vector<bundle_folder::IndexedRegion>& regions) {
    bundle_folder::RegionFile& file = regions[region].file;
    file.bytes = content.size();
    file.checksum = checksum_of(content);
    file.points = points;
  });
  write_text(root / ("r" + std::to_string(region) + ".region"), content);
}

TEST_CASE("shared_tiles: a region names each tile once, and tiles share no bytes") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "b";
  // Every point of every tile: the lists are codes without bytes.
  const PointCloud map{{1, 1, 0}, {2, 1, 0}, {31, 1, 0}, {32, 1, 0}, {61, 1, 0}};
  write_bundle(shared_store_at(root), index_of_regions(1), {{map, {Point(1, 2, 3)}, {}}});
  const std::string good = read_text(root / "r0.region");
  const ForgedRegion sound(good, 1);
  REQUIRE(sound.parts.size() == 3);
  REQUIRE(sound.content() == good);
  forge(root, 0, good, map.size());
  CHECK(map_in(shared_store_at(root), 0)->points == map);
  const auto refused = [&](const auto& change, std::uint64_t points) {
    ForgedRegion forged = sound;
    change(forged);
    forge(root, 0, forged.content(), points);
    const auto read = map_in(shared_store_at(root), 0);
    check_fails(read, ErrorCode::corrupt_data, "the list of tiles is damaged");
    check_fails(read, ErrorCode::corrupt_data, (root / "r0.region").string());
  };
  refused(  // 40 bytes a time
      [](ForgedRegion& f) { f.parts.insert(f.parts.begin(), 100'000, f.parts.front()); },
      map.size() + 200'000);
  refused([](ForgedRegion& f) { f.parts[1] = f.parts[0]; }, map.size());
  refused([](ForgedRegion& f) { std::swap(f.parts[0], f.parts[1]); }, map.size());
  refused([](ForgedRegion& f) { f.parts[0].bytes += 8; }, map.size());
  refused([](ForgedRegion& f) { f.parts[2].bytes = ~std::uint64_t{0}; }, map.size());
  refused([](ForgedRegion& f) { f.parts[2].count = 1'000; }, map.size() + 999);
}

TEST_CASE("shared_tiles: forged regions with sound checksums are refused or read, never a crash") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "b";
  const auto maps = views_of_map(lattice_map(400), 2);
  write_bundle(shared_store_at(root), index_of_regions(2), maps);
  const std::string good = read_text(root / "r1.region");
  std::mt19937 random(6);
  int refused = 0;
  for (int n = 0; n < 1500; ++n) {
    std::string bad = good;
    for (int k = 1 + static_cast<int>(random() % 3); k > 0; --k) {
      bad[random() % bad.size()] = "\0\1\x7f\x80\xff"[random() % 5];
    }
    if (n % 10 == 0) bad.resize(random() % bad.size() / 8 * 8);
    forge(root, 1, bad, maps[1].points.size());
    const auto read = map_in(shared_store_at(root), 1);
    if (read) {
      CHECK(read->points.size() == maps[1].points.size());
      continue;
    }
    ++refused;
    CHECK(read.error().code == ErrorCode::corrupt_data);
  }
  CHECK(refused > 500);
}

TEST_CASE("shared_tiles: a map may lie at any height, and its tiles may be as wide as a county") {
  for (const double height : {0.0, 6'371'000.0, -50'000.0}) {
    for (const char* width : {"20.0", "5200.0", "50000.0"}) {
      CAPTURE(height);
      CAPTURE(width);
      const test::TemporaryFolder folder;
      // Places in cells and layers far apart, each with several points; regions see half of them.
      std::mt19937 random(2);
      const auto beside = [&] { return static_cast<double>(random() % 640) / 64.0; };
      PointCloud map;
      for (int place = 0; place < 60; ++place) {
        const auto somewhere = [&](int range) {
          return static_cast<double>(
              static_cast<int>(random() % (2U * static_cast<unsigned>(range))) - range);
        };
        const Point at(somewhere(16'000), somewhere(16'000), height + somewhere(60'000));
        for (int k = 0; k < 20; ++k) {
          map.push_back(at + Point(beside(), beside(), beside()));
        }
      }
      std::ranges::sort(map, canonically_before);
      auto maps = views_of_map(map, 12);
      std::ranges::shuffle(maps.back().points, random);
      const auto index = index_of_regions(maps.size());
      const std::string params = "tile_width = " + std::string(width);
      write_bundle(shared_store_at(folder.path() / "one", params), index, maps);
      const auto back = opened(shared_store_at(folder.path() / "one"));
      for (std::uint32_t r = 0; r < maps.size(); ++r) {
        const auto read = back->get(RegionId{r});
        REQUIRE_MESSAGE(read, to_string(read.error()));
        CHECK(worst(read->points, maps[r].points) < 120e3 * 0x1p-25 + 1e-6);  // README: precision
      }
      // Whatever the order of the puts, the points are in the one canonical order.
      auto writer =
          begun(shared_store_at(folder.path() / "two", params + "\nbuild_cache = 0"), index);
      for (auto r = static_cast<std::uint32_t>(maps.size()); r-- > 0;) {
        REQUIRE(writer->put(RegionId{r}, maps[r]));
      }
      commit(std::move(writer));
      check_same_files(folder.path() / "one", folder.path() / "two");
    }
  }
}

TEST_CASE("shared_tiles: what a killed build has left is cleared by the next one") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "b", partial = folder.path() / "b.partial";
  fs::create_directory(partial);
  for (const char* name : {".vantage-partial", "r0.region", "scratch.tmp", "tiles.bin"}) {
    write_text(partial / name, "half");
  }
  const auto maps = views_of_map(lattice_map(100), 2);
  write_bundle(shared_store_at(root), index_of_regions(2), maps);
  check_all(shared_store_at(root), maps);
  CHECK(files_in(folder.path()) == std::vector<std::string>{"b"});
}

TEST_CASE("shared_tiles: points that no tile can hold are refused and leave the region to be put") {
  const test::TemporaryFolder folder;
  auto writer = begun(shared_store_at(folder.path() / "b"), index_of_regions(1));
  check_fails(writer->put(RegionId{0}, points_alone({{1e20, 0, 0}})), ErrorCode::invalid_input,
              "too far from the map's origin");
  check_fails(writer->put(RegionId{0}, points_alone({{0, 0, 1e38}})), ErrorCode::invalid_input,
              "too far from the map's origin");
  check_fails(writer->put(RegionId{0}, points_alone({{0, std::nan(""), 0}})),
              ErrorCode::invalid_input, "not finite");
  CHECK(writer->put(RegionId{0}, points_alone({{1, 2, 3}})));
  commit(std::move(writer));
}

TEST_CASE("shared_tiles: bundles of the two stores are not mistaken for each other") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "b";
  write_bundle(shared_store_at(root), index_of_regions(1), {points_alone({{1, 2, 3}})});
  const auto other = test::plugin<MapStore>("pcd_tiles", "root = '" + root.string() + "'");
  check_fails(other->open(), ErrorCode::corrupt_data, "'format' must be 'vantage pcd_tiles'");
  check_fails(other->begin(index_of_regions(1)), ErrorCode::already_exists, "not a bundle");
}

}  // namespace
}  // namespace vantage
