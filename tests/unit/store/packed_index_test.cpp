#include "common/packed_index.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <tuple>

#include "common/packed_pages.hpp"
#include "format.hpp"
#include "store_samples.hpp"
#include "support/real_data.hpp"

namespace vantage::bundle_folder {
namespace {

namespace fs = std::filesystem;
using pcd_tiles::kFormat;

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
    Region region{"region_" + std::to_string(r * 31 % count), box(), {}};
    if (r % 3 == 1) region.footprint = BoxUnion{{box(), box()}};
    if (r % 3 == 2) {
      const Eigen::Vector2d at(place(random), place(random));
      region.footprint =
          ConvexPolygon{{at, at + Eigen::Vector2d(20.0, 3.0), at + Eigen::Vector2d(4.0, 18.0)}};
    }
    if (r % 2 == 1) region.height = {-1.0 / 3.0, store_samples::kInfinity};
    sample.regions.push_back(std::move(region));
    RegionFile file{.points = random() % 5 == 0 ? 0 : random() % 1000,
                    .viewpoints = random() % 100,
                    .elements = random() % 3,
                    .prepared_bytes = 1 + random() % 1000,
                    .origin = {place(random), -0.0, 1e-300},
                    .checksum = random()};
    if (file.points > 0) file.max_views = static_cast<std::uint32_t>(random() % 7);
    file.bytes = pcd_tiles::file_size(file);
    sample.files.push_back(file);
  }
  return sample;
}

std::string packed(const Many& sample, RegionsReference& reference) {
  std::string bytes;
  reference = write_packed(kFormat, sample.regions, sample.files,
                           [&](std::string_view more) -> Result<void> {
                             bytes += more;
                             return {};
                           })
                  .value();
  return bytes;
}

Result<PackedIndex> open_packed(const fs::path& file) {
  VANTAGE_TRY(io::InputFile regions, io::InputFile::open(file, "the regions of a bundle"));
  return PackedIndex::open(kFormat, std::move(regions));
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
    RegionsReference reference;
    write_file(file, packed(sample, reference));
    const auto index = open_packed(file);
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
    const auto all = index->all();
    REQUIRE_MESSAGE(all, to_string(all.error()));
    CHECK(all->size() == count);
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
  RegionsReference a, b;
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
  RegionsReference reference;
  const std::string sound = packed(sample, reference);
  std::mt19937 random(4);
  int refused = 0;
  const auto check = [&](const std::string& bytes) {
    write_file(file, bytes);
    const auto index = open_packed(file);
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
    CHECK_FALSE(open_packed(file));
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

/// A file whose checksums are right whatever its pages say.
class Forgery {
 public:
  explicit Forgery(std::string sound) : bytes_(std::move(sound)) {}

  [[nodiscard]] packed::Summary& summary() { return at<packed::Summary>(pages() - 1, 0); }
  [[nodiscard]] packed::Layout layout() {
    return packed::Layout::of(summary().regions, summary().entries_bytes);
  }
  [[nodiscard]] std::uint64_t pages() const { return bytes_.size() / packed::kPage; }
  template <class T>
  [[nodiscard]] T& at(std::uint64_t page, std::size_t offset) {
    return *reinterpret_cast<T*>(bytes_.data() + page * packed::kPage + offset);
  }
  [[nodiscard]] packed::Node& node(std::uint64_t page) { return at<packed::Node>(page, 0); }
  [[nodiscard]] packed::Child& child(std::uint64_t page, std::size_t k) {
    return at<packed::Child>(page, sizeof(packed::Node) + k * sizeof(packed::Child));
  }
  /// The bytes, with checksums.
  [[nodiscard]] std::string sealed() {
    Checksum content;
    const std::uint64_t first = layout().first_offsets;
    for (std::uint64_t r = 1; r <= summary().regions; ++r) {
      const auto end = at<std::uint64_t>(first + r / packed::kOffsets, r % packed::kOffsets * 8);
      if (end >= 8 && end <= bytes_.size()) {
        content.add(packed::get<std::uint64_t>(bytes_.data() + end - 8));
      }
    }
    for (std::uint64_t k = first; k < pages(); ++k) {
      if (k + 1 == pages()) summary().content = content.value();
      const std::uint64_t sum = packed::sum_of_page(bytes_.data() + k * packed::kPage, k);
      at<std::uint64_t>(k, packed::kContent) = sum;
      content.add(sum);
    }
    return bytes_;
  }

 private:
  std::string bytes_;
};

TEST_CASE("packed regions: what no partition can have is refused when a region is read") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / kRegionsFile;
  const auto refused = [&](const auto& change, const std::string& because) {
    Many sample = many(5, 3);
    change(sample.regions[3], sample.files[3]);
    RegionsReference reference;
    write_file(file, packed(sample, reference));
    const auto index = open_packed(file);
    REQUIRE_MESSAGE(index, to_string(index.error()));
    CHECK(index->entry(2));
    store_samples::check_fails(index->entry(3), ErrorCode::corrupt_data, because);
    store_samples::check_fails(index->all(), ErrorCode::corrupt_data, because);
    store_samples::check_fails(index->find(sample.regions[3].label), ErrorCode::corrupt_data,
                               because);
  };
  for (const char* label : {"../planted", "/etc/passwd", "a/b", "", ".hidden", "a\nb"}) {
    CAPTURE(label);
    refused([&](Region& region, RegionFile&) { region.label = label; }, "a label is");
  }
  refused([](Region& r, RegionFile&) { r.height = {2.0, 2.0}; }, "height interval");
  refused([](Region& r, RegionFile&) { r.footprint = HalfOpenBox{{0, 0}, {0, 1}}; }, "empty");
  refused(
      [](Region& r, RegionFile&) {
        r.footprint = ConvexPolygon{{{0, 0}, {0, 1}, {1, 0}}};
      },
      "convex");
  const std::string contradicts = "contradicts itself: ";
  const auto sized = [](RegionFile& f) { f.bytes = pcd_tiles::file_size(f); };
  const auto file_must = contradicts + "the file must have ";
  refused([](Region&, RegionFile& f) { f.bytes += 1; }, file_must);
  refused([](Region&, RegionFile& f) { f.points += 1; }, file_must);
  refused([](Region&, RegionFile& f) { f.viewpoints += 1; }, file_must);
  refused([](Region&, RegionFile& f) { f.prepared_bytes += 4; }, file_must);
  refused([](Region&, RegionFile& f) { f.max_views = f.max_views > 0 ? 0 : 5; }, file_must);
  refused(
      [&](Region&, RegionFile& f) {
        f.points = 0, f.max_views = 7;
        sized(f);
      },
      contradicts + "the most views");
  refused([](Region&, RegionFile& f) { f.origin.x() = store_samples::kInfinity; },
          contradicts + "the origin must be finite");
  refused(
      [&](Region&, RegionFile& f) {
        f.points = kMaxPoints + 1;
        sized(f);
      },
      contradicts + "1099511627777 points, at most 1099511627776");
  refused(
      [&](Region&, RegionFile& f) {
        f.viewpoints = kMaxPoints + 1;
        sized(f);
      },
      contradicts + "1099511627777 viewpoints");
  refused(
      [&](Region&, RegionFile& f) {
        f.prepared_bytes = kMaxPreparedBytes + 1;
        sized(f);
      },
      contradicts + "1125899906842625 prepared bytes");
  refused(
      [&](Region&, RegionFile& f) {
        f.elements = 1, f.prepared_bytes = 0;
        sized(f);
      },
      contradicts + "elements must be 0");
}

TEST_CASE("packed regions: a forged tree ends, and gives no region twice") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / kRegionsFile;
  const Many sample = many(12'000, 9);  // three levels
  RegionsReference reference;
  const std::string sound = packed(sample, reference);
  const Bounds2 everywhere{Eigen::Vector2d::Constant(-1e9), Eigen::Vector2d::Constant(1e9)};
  {
    write_file(file, Forgery(sound).sealed());
    const auto index = open_packed(file);
    REQUIRE_MESSAGE(index, to_string(index.error()));
    CHECK(index->meeting(everywhere)->size() == 12'000);
    CHECK(index->all()->size() == 12'000);
  }
  const auto refused = [&](const auto& change) {
    Forgery forgery(sound);
    const packed::Layout layout = forgery.layout();
    REQUIRE(layout.levels.size() == 3);
    change(forgery, layout);
    write_file(file, forgery.sealed());
    const auto index = open_packed(file);
    REQUIRE_MESSAGE(index, to_string(index.error()));
    store_samples::check_fails(index->meeting(everywhere), ErrorCode::corrupt_data, "tree");
    store_samples::check_fails(index->all(), ErrorCode::corrupt_data, "tree");
  };
  const auto leaf = [](const packed::Layout& layout) { return layout.levels[0].first + 7; };
  refused([&](Forgery& f, const auto& layout) { f.node(leaf(layout)).children = 1; });
  refused([&](Forgery& f, const auto& layout) { f.node(leaf(layout)).children = 0xffff'ffffU; });
  refused([&](Forgery& f, const auto& layout) { f.node(leaf(layout)).level = 1; });
  refused([&](Forgery& f, const auto& layout) {  // the same region again and again
    for (std::size_t k = 1; k < 50; ++k) {
      f.child(leaf(layout), k).region = f.child(leaf(layout), 0).region;
    }
  });
  refused([&](Forgery& f, const auto& layout) { f.child(leaf(layout), 3).region = 12'000; });
  refused([&](Forgery& f, const auto& layout) { f.child(leaf(layout), 3).box[0] = -1e6; });
  refused([&](Forgery& f, const auto& layout) { f.child(leaf(layout), 3).box[0] = std::nan(""); });
  refused([&](Forgery& f, const auto& layout) {  // the root: each child is the first one
    const std::uint64_t root = layout.levels[2].first;
    for (std::size_t k = 1; k < f.node(root).children; ++k) f.child(root, k) = f.child(root, 0);
  });
}

TEST_CASE("packed regions: forged pages with sound checksums are refused, or say what is right") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / kRegionsFile;
  const Many sample = many(700, 9);
  RegionsReference reference;
  const std::string sound = packed(sample, reference);
  std::mt19937 random(11);
  int refused = 0;
  for (int n = 0; n < 400; ++n) {
    CAPTURE(n);
    Forgery forgery(sound);
    const std::uint64_t first = forgery.layout().first_offsets;
    const std::uint64_t page = first + random() % (forgery.pages() - first);
    const std::size_t used = page + 1 == forgery.pages() ? sizeof(packed::Summary) : 4080;
    auto& word = forgery.at<std::uint32_t>(page, random() % (used / 4) * 4);
    const std::uint32_t other[] = {word ^ 1U, word + 1, 0, 0xffff'ffffU,
                                   static_cast<std::uint32_t>(random())};
    word = other[random() % 5];
    if (forgery.summary().regions != 700 || forgery.layout().last + 1 != forgery.pages()) {
      continue;  // `sealed` does not know where anything is
    }
    write_file(file, forgery.sealed());
    const auto index = open_packed(file);
    const auto all = index.and_then([](const PackedIndex& one) { return one.all(); });
    if (!all) {
      CHECK(all.error().code == ErrorCode::corrupt_data);
      ++refused;
    } else {
      for (std::uint32_t r = 0; r < 700; ++r) {
        CHECK((*all)[r].region == sample.regions[r]);
        CHECK(same((*all)[r].file, sample.files[r]));
      }
    }
    if (!index) continue;
    for (int k = 0; k < 5; ++k) {
      const auto found = index->meeting(some_area(random));
      if (!found) continue;
      CHECK(std::ranges::adjacent_find(*found) == found->end());
      CHECK((found->empty() || found->back().value < 700));
    }
    (void)index->find(sample.regions[random() % 700].label);
  }
  CHECK(refused > 100);
}

}  // namespace
}  // namespace vantage::bundle_folder
