#include "common/packed_index.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <tuple>

#include "store_samples.hpp"
#include "support/real_data.hpp"
#include "support/text.hpp"
#include "vantage/region_directory.hpp"

namespace vantage::bundle_folder {
namespace {

namespace fs = std::filesystem;

struct Many {
  std::vector<Region> regions;
  std::vector<RegionFile> files;
};

/// Footprints of every shape and of very different sizes; many of them overlap.
Many many(std::uint32_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-3000.0, 3000.0), logarithm(0.0, 6.0);
  const auto box = [&] {
    const Eigen::Vector2d min(place(random), place(random));
    return HalfOpenBox{min, min + Eigen::Vector2d(std::exp(logarithm(random)), 7.0)};
  };
  Many sample;
  for (std::uint32_t r = 0; r < count; ++r) {
    Region region{"region " + std::to_string(r * 31 % count), box(), {}};
    if (r % 3 == 1) region.footprint = BoxUnion{{box(), box()}};
    if (r % 3 == 2) {
      const Eigen::Vector2d at(place(random), place(random));
      region.footprint =
          ConvexPolygon{{at, at + Eigen::Vector2d(20.0, 3.0), at + Eigen::Vector2d(4.0, 18.0)}};
    }
    if (r % 2 == 1) region.height = {-1.0 / 3.0, store_samples::kInfinity};
    sample.regions.push_back(std::move(region));
    sample.files.push_back({.points = random() % 5 == 0 ? 0 : random() % 1000,
                            .viewpoints = random() % 100,
                            .elements = random() % 3,
                            .prepared_bytes = random() % 1000,
                            .origin = {place(random), -0.0, 1e-300},
                            .bytes = random(),
                            .checksum = random(),
                            .max_views = static_cast<std::uint32_t>(random() % 7)});
  }
  return sample;
}

std::string packed(const Many& sample, PackedRegions& reference) {
  std::string bytes;
  reference =
      write_packed(sample.regions, sample.files, [&](std::string_view more) -> Result<void> {
        bytes += more;
        return {};
      }).value();
  return bytes;
}

void write_file(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

bool same(const RegionFile& a, const RegionFile& b) {
  const auto all = [](const RegionFile& f) {
    return std::tuple(f.points, f.viewpoints, f.elements, f.prepared_bytes, f.bytes, f.checksum,
                      f.max_views, f.origin.x(), f.origin.y(), std::signbit(f.origin.y()),
                      f.origin.z());
  };
  return all(a) == all(b);
}

std::vector<RegionId> meeting(const std::vector<Region>& regions, const Bounds2& area) {
  std::vector<RegionId> found;
  for (std::uint32_t r = 0; r < regions.size(); ++r) {
    const Bounds2 box = bounds_of(regions[r].footprint);
    if ((box.min.array() <= area.max.array()).all() &&
        (area.min.array() <= box.max.array()).all()) {
      found.push_back(RegionId{r});
    }
  }
  return found;
}

Bounds2 some_area(std::mt19937& random) {
  std::uniform_real_distribution<double> place(-3500.0, 3500.0), logarithm(-3.0, 9.0);
  const Eigen::Vector2d min(place(random), place(random));
  return {min, min + Eigen::Vector2d(std::exp(logarithm(random)), std::exp(logarithm(random)))};
}

TEST_CASE("packed regions: entries, areas and labels, from one region to thousands") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / kRegionsFile;
  for (const std::uint32_t count : {1U, 2U, 101U, 102U, 511U, 512U, 20'000U}) {
    CAPTURE(count);
    const Many sample = many(count, count);
    PackedRegions reference;
    write_file(file, packed(sample, reference));
    const auto index = PackedIndex::open(file);
    REQUIRE_MESSAGE(index, to_string(index.error()));
    CHECK(index->reference() == reference);
    CHECK(index->totals().regions == count);
    std::uint64_t points = 0, empty = 0;
    for (const RegionFile& one : sample.files) {
      points += one.points;
      empty += one.points == 0 && one.elements == 0 ? 1U : 0U;
    }
    CHECK(index->totals().points == points);
    CHECK(index->totals().empty == empty);
    for (std::uint32_t r = 0; r < count; r += 1 + count / 500) {
      CAPTURE(r);
      const auto entry = index->entry(r);
      REQUIRE_MESSAGE(entry, to_string(entry.error()));
      CHECK(entry->region == sample.regions[r]);
      CHECK(same(entry->file, sample.files[r]));
      CHECK(index->find(sample.regions[r].label) == RegionId{r});
    }
    CHECK(index->find("region") == std::nullopt);
    CHECK(index->find("") == std::nullopt);
    std::mt19937 random(count);
    for (int k = 0; k < 200; ++k) {
      const Bounds2 area = some_area(random);
      CHECK(index->meeting(area) == meeting(sample.regions, area));
    }
  }
}

TEST_CASE("packed regions: the same bytes each time") {
  const Many sample = many(300, 1);
  PackedRegions a, b;
  CHECK(packed(sample, a) == packed(sample, b));
  CHECK(a == b);
  Many other = sample;
  other.files[200].checksum ^= 1U;
  CHECK(packed(other, b) != packed(sample, a));
}

TEST_CASE("packed regions: damage anywhere is found, or what is said is right") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / kRegionsFile;
  const Many sample = many(700, 9);
  PackedRegions reference;
  const std::string sound = packed(sample, reference);
  std::mt19937 random(4);
  int refused = 0;
  const auto check = [&](const std::string& bytes) {
    write_file(file, bytes);
    const auto index = PackedIndex::open(file);
    if (!index) {
      CHECK(index.error().code == ErrorCode::corrupt_data);
      ++refused;
      return;
    }
    const auto right_or_refused = [&](const auto& answer, const auto& is_right) {
      if (answer) {
        CHECK(is_right(*answer));
      } else {
        CHECK(answer.error().code == ErrorCode::corrupt_data);
        ++refused;
      }
    };
    for (std::uint32_t r = 0; r < 700; r += 7) {
      right_or_refused(index->entry(r), [&](const IndexedRegion& one) {
        return one.region == sample.regions[r] && same(one.file, sample.files[r]);
      });
      right_or_refused(index->find(sample.regions[r].label),
                       [&](const auto& found) { return found == RegionId{r}; });
    }
    for (int k = 0; k < 5; ++k) {
      const Bounds2 area = some_area(random);
      right_or_refused(index->meeting(area), [&](const std::vector<RegionId>& found) {
        return found == meeting(sample.regions, area);
      });
    }
  };
  for (int k = 0; k < 150; ++k) {
    std::string bytes = sound;
    const std::size_t at = random() % bytes.size();
    CAPTURE(at);
    bytes[at] = static_cast<char>(bytes[at] ^ static_cast<char>(1U << random() % 8));
    check(bytes);
  }
  CHECK(refused > 100);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1}, std::size_t{4096}, sound.size() - 4096, sound.size() - 1}) {
    CAPTURE(size);
    write_file(file, sound.substr(0, size));
    CHECK_FALSE(PackedIndex::open(file));
  }
  // Pages in each other's places.
  std::string swapped = sound;
  const std::size_t last = swapped.size() / 4096 - 1;
  std::swap_ranges(swapped.begin() + static_cast<std::ptrdiff_t>((last - 2) * 4096),
                   swapped.begin() + static_cast<std::ptrdiff_t>((last - 1) * 4096),
                   swapped.begin() + static_cast<std::ptrdiff_t>((last - 1) * 4096));
  const int before = refused;
  check(swapped);
  CHECK(refused > before);
}

TEST_CASE("a bundle of thousands of regions has a packed index, and reads as any other") {
  for (const char* plugin : {"pcd_tiles", "shared_tiles"}) {
    CAPTURE(plugin);
    const test::TemporaryFolder folder;
    const fs::path root = folder.path() / "bundle";
    const auto open = [&] {
      return test::plugin<MapStore>(plugin, "root = '" + root.string() + "'\noverwrite = true");
    };
    const auto write = [&](std::uint32_t count) {
      MapIndex index;
      std::vector<Region> regions;
      for (std::uint32_t r = 0; r < count; ++r) {
        const Eigen::Vector2d min(r % 100, r / 100);
        regions.push_back(
            {"r" + std::to_string(r), HalfOpenBox{min, min + Eigen::Vector2d(1.0, 1.0)}, {}});
      }
      index.partition = Partition::from(std::move(regions)).value();
      index.map_bounds = {Point(0, 0, 0), Point(100, 100, 1)};
      index.map_points = count;
      index.config = "# made up";
      const auto store = open();
      REQUIRE(store->begin(index));
      for (std::uint32_t r = 0; r < count; ++r) {
        RegionMap map;
        if (r % 10 != 3) map.points.emplace_back(r % 100 + 0.5, r / 100 + 0.5, 0.25);
        REQUIRE(store->put(RegionId{r}, map));
      }
      const auto committed = store->commit();
      REQUIRE_MESSAGE(committed, to_string(committed.error()));
    };
    write(4097);
    CHECK(fs::exists(root / kRegionsFile));
    CHECK(fs::file_size(root / "index.json") < 4000);
    {
      const auto store = open();
      const auto directory = store->directory();
      REQUIRE_MESSAGE(directory, to_string(directory.error()));
      CHECK((*directory)->summary().regions == 4097);
      CHECK((*directory)->summary().empty_regions == 410);
      CHECK((*directory)->find("r4000") == RegionId{4000});
      CHECK((*directory)->meeting({{5.5, 7.5}, {5.5, 7.5}}) == std::vector{RegionId{705}});
      CHECK((*directory)->entry(RegionId{4097}).error().code == ErrorCode::not_found);
      const auto index = store->index();
      REQUIRE_MESSAGE(index, to_string(index.error()));
      CHECK(index->partition.size() == 4097);
      CHECK(index->partition[RegionId{4096}].label == "r4096");
      CHECK(index->regions[705].points == 1);
      CHECK(store->get(RegionId{705})->points == PointCloud{Point(5.5, 7.5, 0.25)});
      CHECK(store->get(RegionId{3})->points.empty());
      CHECK(store->get(RegionId{4097}).error().code == ErrorCode::not_found);
    }
    // An index whose regions are another bundle's.
    const std::string json = test::read_text(root / "index.json");
    write(4098);
    write_file(root / "index.json", json);
    CHECK(open()->directory().error().code == ErrorCode::corrupt_data);
    fs::remove(root / kRegionsFile);
    CHECK(open()->directory().error().code == ErrorCode::corrupt_data);
    fs::remove_all(root);
    write(4097);
    write(4096);  // takes its place
    CHECK_FALSE(fs::exists(root / kRegionsFile));
    CHECK(open()->index()->partition.size() == 4096);
  }
}

}  // namespace
}  // namespace vantage::bundle_folder
