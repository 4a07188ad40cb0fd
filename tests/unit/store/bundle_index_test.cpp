// index.json and regions.idx of a bundle together: of any size, damaged, and forged.
#include <doctest/doctest.h>

#include <random>

#include "format.hpp"
#include "store_samples.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/region_directory.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::read_text, test::write_text;
using namespace store_samples;  // NOLINT(google-build-using-namespace)

TEST_CASE("a bundle reads the same, whatever the number of its regions") {
  for (const char* plugin : {"pcd_tiles", "shared_tiles"}) {
    CAPTURE(plugin);
    const test::TemporaryFolder folder;
    const fs::path root = folder.path() / "bundle";
    const auto store =
        test::plugin<MapStore>(plugin, "root = '" + root.string() + "'\noverwrite = true");
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
      std::vector<RegionMap> maps(count);
      for (std::uint32_t r = 0; r < count; ++r) {
        if (r % 10 != 3) maps[r].points.emplace_back(r % 100 + 0.5, r / 100 + 0.5, 0.25);
      }
      write_bundle(store, index, maps);
    };
    for (const std::uint32_t count : {1U, 25U, 4097U}) {
      CAPTURE(count);
      write(count);
      CHECK(fs::file_size(root / "index.json") < 1000);
      const auto bundle = opened(store);
      const auto directory = bundle->directory();
      REQUIRE_MESSAGE(directory, to_string(directory.error()));
      const std::uint32_t last = count - 1;
      CHECK((*directory)->summary().regions == count);
      CHECK((*directory)->summary().empty_regions == (count + 6) / 10);
      CHECK((*directory)->summary().map_points == count);
      CHECK((*directory)->summary().config == "# made up");
      CHECK((*directory)->find("r" + std::to_string(last)) == RegionId{last});
      CHECK((*directory)->find("r" + std::to_string(count)) == std::nullopt);
      const Eigen::Vector2d inside(last % 100 + 0.5, last / 100 + 0.5);
      CHECK((*directory)->meeting({inside, inside}) == std::vector{RegionId{last}});
      CHECK((*directory)->entry(RegionId{count}).error().code == ErrorCode::not_found);
      const auto index = bundle->index();
      REQUIRE_MESSAGE(index, to_string(index.error()));
      CHECK(index->partition.size() == count);
      CHECK(index->partition[RegionId{last}].label == "r" + std::to_string(last));
      CHECK(index->regions[0].points == 1);
      CHECK(bundle->get(RegionId{0})->points == PointCloud{Point(0.5, 0.5, 0.25)});
      CHECK(bundle->get(RegionId{last})->points == PointCloud{Point(inside.x(), inside.y(), 0.25)});
      CHECK(bundle->get(RegionId{count}).error().code == ErrorCode::not_found);
      if (count > 3) CHECK(bundle->get(RegionId{3})->points.empty());
    }
    // An index whose regions are another bundle's.
    const std::string json = read_text(root / "index.json");
    write(26);
    write_text(root / "index.json", json);
    CHECK(store->open().error().code == ErrorCode::corrupt_data);
    fs::remove(root / "regions.idx");
    CHECK(store->open().error().code == ErrorCode::corrupt_data);
  }
}

TEST_CASE("a damaged index is corrupt_data that names the file and what was expected") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle", file = root / "index.json";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  const std::string good = read_text(file);
  const auto corrupt = [&](const std::string& text, const std::string& because) {
    write_text(file, text);
    const auto store = pcd_tiles_at(root);
    check_fails(store->open(), ErrorCode::corrupt_data, because);
    check_fails(store->open(), ErrorCode::corrupt_data, file.string());
  };
  corrupt("", "not JSON");
  corrupt(std::string(100'000, '['), "not JSON");
  corrupt("[]", "the index must be an object, found array");
  corrupt("{}", "no member 'format'");
  corrupt(replaced(good, "vantage pcd_tiles", "vantage other"), "'format' must be");
  for (const std::string older : {"1", "2", "3", "4", "5"}) {
    corrupt(replaced(good, "\"version\": 6", "\"version\": " + older),
            "'version' is " + older +
                ", and 6 is needed: the bundle was built by an older version; remove it and build "
                "it again");
  }
  corrupt(replaced(good, "\"version\": 6", "\"version\": 7"), "a newer version");
  for (const std::string odd : {"0", "-2", "2.0", "\"2\"", "\"6\"", "null", "[2]"}) {
    corrupt(replaced(good, "\"version\": 6", "\"version\": " + odd), "'version' must be 6, not");
  }
  corrupt(replaced(good, "\"regions\"", "\"region\""), "no member 'regions'");
  corrupt(replaced(good, "\"regions\": {", "\"regions\": [], \"x\": {"),
          "'regions' must be an object, found array");
  corrupt(replaced(good, "\"config\": \"", "\"config\": 7, \"x\": \""),
          "'config' must be a string");
  corrupt(replaced(good, "\"file\": \"regions.idx\"", "\"file\": \"../regions.idx\""),
          "'regions.file' must be 'regions.idx', not '../regions.idx'");
  corrupt(replaced(good, "\"file\": \"regions.idx\"", "\"file\": \"a\\n\\u001b[31m\""),
          "'regions.file' must be 'regions.idx', not 'a\\n\\u001b[31m'");
  for (const std::string odd : {"0", "-1", "3e0", "4294967295", "18446744073709551616"}) {
    corrupt(replaced(good, "\"count\": 3", "\"count\": " + odd),
            "'regions.count' must be an integer from 1 to 4294967294");
  }
  corrupt(replaced(good, "\"points\": 123456789", "\"points\": -1"), "'map.points' must be");
  corrupt(replaced(good, "\"points\": 123456789", "\"points\": 1e3"), "'map.points' must be");
  corrupt(replaced(good, "\"min\": [", "\"min\": 5, \"x\": ["),
          "'map.bounds.min' must be an array");
  corrupt(replaced(good, "77.7", "77.7, 1"), "'map.bounds.max' must be an array of 3 numbers");
  corrupt(replaced(good, "\"checksum\": \"", "\"checksum\": \"g"), "16 hexadecimal digits");
  corrupt(replaced(good, "\"checksum\": \"", "\"checksum\": \"\\n"), "digits, not '\\n");
  corrupt(replaced(good, "77.7", "\"endless\""), "'map.bounds.max[2]' must be a number");
  corrupt(replaced(good, "77.7", "1e999"), "damaged");

  // A number or a text that is as good as the right one.
  const std::string checksum = "'checksum' is not that of the rest";
  corrupt(replaced(good, "\"points\": 123456789", "\"points\": 123456788"), checksum);
  corrupt(replaced(good, "77.7", "77.8"), checksum);
  corrupt(replaced(good, "77.7", "\"inf\""), checksum);
  corrupt(replaced(good, "quoted", "Quoted"), checksum);
  corrupt(replaced(good, "\"count\": 3", "\"count\": 2"), checksum);
  const std::size_t last = good.rfind("\"checksum\"");
  corrupt(good.substr(0, last) + "\"checksum\": \"0000000000000000\"}", checksum);
  corrupt(good.substr(0, last) + "\"checksam\": 0}", "no member 'checksum'");

  // The layout does not matter.
  std::string other_layout = good;
  std::replace(other_layout.begin(), other_layout.end(), '\n', ' ');
  write_text(file, other_layout);
  CHECK(index_in(pcd_tiles_at(root)));

  // Cut anywhere it is no JSON, but for the newline at its end.
  for (std::size_t length = 0; length + 1 < good.size(); length += 13) {
    write_text(file, good.substr(0, length));
    const auto index = index_in(pcd_tiles_at(root));
    REQUIRE(!index);
    CHECK(index.error().code == ErrorCode::corrupt_data);
    CHECK(index.error().where->line > 0);
  }
  write_text(file, good);
  CHECK(index_in(pcd_tiles_at(root)));
}

TEST_CASE("an index that is nested without end is refused, wherever the nesting is") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle", file = root / "index.json";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  const std::string good = read_text(file);
  const std::string arrays = std::string(200'000, '[') + std::string(200'000, ']');
  std::string objects = "1";
  for (int k = 0; k < 100; ++k) objects = "{\"x\":" + objects + "}";
  for (const std::string& deep : {arrays, objects}) {
    for (const std::string& text :
         {deep, replaced(good, "\"format\"", "\"more\": " + deep + ", \"format\""),
          replaced(good, "\"version\": 6", "\"version\": " + deep), replaced(good, "77.7", deep)}) {
      write_text(file, text);
      const auto store = pcd_tiles_at(root);
      check_fails(store->open(), ErrorCode::corrupt_data, "of at most 64 levels");
      check_fails(store->open(), ErrorCode::corrupt_data, file.string());
    }
  }
}

TEST_CASE("an index of more than 4 MiB is not read, and no build writes one") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  const auto files = [&] { return files_in(folder.path()); };
  MapIndex index = sample_index();
  index.config.assign(std::size_t{4} << 20U, '#');
  check_fails(pcd_tiles_at(root)->begin(index), ErrorCode::invalid_input,
              "the configuration text has 4194304 bytes");
  CHECK(files().empty());
  index.config.resize(index.config.size() - 2000);
  write_bundle(pcd_tiles_at(root), index, sample_maps());
  CHECK(index_in(pcd_tiles_at(root))->config == index.config);
  const std::string good = read_text(root / "index.json");
  write_text(root / "index.json", good + std::string(2000, '\n'));
  for (const std::string& part :
       {std::string("bytes, expected at most 4194304"), (root / "index.json").string()}) {
    check_fails(pcd_tiles_at(root)->open(), ErrorCode::corrupt_data, part);
  }
}

TEST_CASE("forged regions are refused, whatever their checksums say") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  using All = std::vector<bundle_folder::IndexedRegion>;
  const auto forge = [&](const auto& change) {
    fs::remove_all(root);
    write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
    bundle_folder::BundleFormat format = pcd_tiles::kFormat;
    format.file_size = nullptr;  // whatever it says
    forge_regions(format, root, change);
  };
  // What is wrong by itself.
  const auto refused = [&](const auto& change, const std::string& because) {
    forge([&](All& all) { change(all[1]); });
    const auto bundle = opened(pcd_tiles_at(root));
    for (const std::string& part : {because, std::string("the entry of region 1 at byte "),
                                    (root / "regions.idx").string()}) {
      check_fails(bundle->get(RegionId{1}), ErrorCode::corrupt_data, part);
      check_fails(bundle->index(), ErrorCode::corrupt_data, part);
      const auto directory = bundle->directory();
      REQUIRE_MESSAGE(directory, to_string(directory.error()));
      check_fails((*directory)->entry(RegionId{1}), ErrorCode::corrupt_data, part);
    }
    CHECK(bundle->get(RegionId{2}));
    check_fails(pcd_tiles_at(root, true)->begin(sample_index()), ErrorCode::already_exists,
                because);
  };
  using One = bundle_folder::IndexedRegion;
  for (const char* label : {"../planted", "../../etc/passwd", "/etc/passwd", "a\n\x1b[31m", ""}) {
    CAPTURE(label);
    refused([&](One& one) { one.region.label = label; }, "describes no sound region: a label is");
  }
  refused(
      [](One& one) {
        one.region.height = {1.0, -kInfinity};
      },
      "describes no sound region: the height interval");
  refused([](One& one) { one.file.points = 1; }, "the file must have ");
  refused([](One& one) { one.file.viewpoints = 6; }, "the file must have ");
  refused([](One& one) { one.file.prepared_bytes = 4; }, "the file must have ");
  refused([](One& one) { one.file.elements = 1; }, "elements must be 0 without prepared bytes");
  refused([](One& one) { one.file.max_views = 3; }, "left out without points");
  refused([](One& one) { one.file.points = ~std::uint64_t{0}; }, "18446744073709551615 points, at");
  refused([](One& one) { one.file.viewpoints = (std::uint64_t{1} << 40U) + 1; },
          "1099511627777 viewpoints, at most 1099511627776 can be");

  // What is wrong among the others.
  forge([](All& all) { all[1].region.label = all[2].region.label; });
  check_fails(index_in(pcd_tiles_at(root)), ErrorCode::corrupt_data,
              "the regions are not a partition");
  check_fails(index_in(pcd_tiles_at(root)), ErrorCode::corrupt_data,
              (root / "regions.idx").string());

  // What is wrong of the file: as many bytes with the padding, but others.
  forge([](All& all) { all[2].file.prepared_bytes += 1; });
  CHECK(map_in(pcd_tiles_at(root), 0));
  CHECK_FALSE(map_in(pcd_tiles_at(root), 2)->prepared == sample_maps()[2].prepared);
  forge([](All& all) { all[0].file.checksum ^= 1U; });
  check_fails(map_in(pcd_tiles_at(root), 0), ErrorCode::corrupt_data, "checksum");

  // Fewer regions: a file that none names.
  forge([](All& all) { all.pop_back(); });
  CHECK(index_in(pcd_tiles_at(root))->partition.size() == 2);
  check_fails(pcd_tiles_at(root, true)->begin(sample_index()), ErrorCode::already_exists,
              "it holds 'storey.2.pcd'");
}

TEST_CASE("regions that are missing, cut off or another bundle's are corrupt_data") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle", file = root / "regions.idx";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  write_bundle(pcd_tiles_at(folder.path() / "other"), sample_index(), std::vector<RegionMap>(3));
  const std::string good = read_text(file);
  const auto refused = [&](const std::string& because) {
    const auto store = pcd_tiles_at(root);
    for (const std::string& part : {because, file.string()}) {
      check_fails(store->open(), ErrorCode::corrupt_data, part);
    }
  };
  fs::remove(file);
  refused("the index names this file, but it is missing");
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, good.size() - 1}) {
    write_text(file, good.substr(0, size));
    refused(size == 0 ? "empty" : "it is cut off");
  }
  write_text(file, good.substr(0, good.size() - 4096));
  refused("the file does not hold the regions of a bundle");
  write_text(file, good + good);
  refused("page 9 does not have its checksum: it is damaged");
  write_text(file, read_text(folder.path() / "other" / "regions.idx"));
  refused("these are not the regions that the index names");
  fs::remove(file);
  fs::create_directory(file);
  check_fails(pcd_tiles_at(root)->open(), ErrorCode::io_failure, file.string());
  fs::remove(file);
  write_text(file, good);
  CHECK(map_in(pcd_tiles_at(root), 0));
}

TEST_CASE("an index with random damage never ends in a crash") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  const std::string good = read_text(root / "index.json");
  std::mt19937 random(4);
  int refused = 0;
  for (int n = 0; n < 500; ++n) {
    std::string bad = good;
    for (int k = 0; k < 3; ++k) {
      bad[random() % bad.size()] = "\"{}[]:,0a- \xff"[random() % 12];
    }
    write_text(root / "index.json", bad);
    const auto index = index_in(pcd_tiles_at(root));
    if (index) continue;
    ++refused;
    CHECK(index.error().code == ErrorCode::corrupt_data);
  }
  CHECK(refused > 250);
}

}  // namespace
}  // namespace vantage
