#include <doctest/doctest.h>

#include <array>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "support/bundles.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/map_store.hpp"
#include "vantage/region_directory.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::write_text;

constexpr const char* kMetaData =
    "grid_size: 20\nmin_pt:\n  x: -41.5\n  y: 10\nmax_pt:\n  x: 8.25\n  y: 49.5\n";

std::string cell_file(const std::vector<std::array<float, 3>>& points,
                      const std::string& fields = "x y z") {
  const std::string n = std::to_string(points.size());
  std::string text = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS " + fields +
                     "\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + n +
                     "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA binary\n";
  for (const auto& p : points) text.append(reinterpret_cast<const char*>(p.data()), sizeof p);
  return text;
}

/// A folder as the authors' program writes it: three cells, and what it saves beside them.
class Folder {
 public:
  Folder() {
    write("grid_meta_data.yaml", kMetaData);
    write("grid_0_0.pcd", cell_file({{-41, 11, 0}, {200, -70.5F, 3}, {-41, 11, 0}}));
    write("grid_2_0.pcd", cell_file({{1, 2, 3}}));
    write("grid_1_1.pcd", cell_file({{0.1F, 0.2F, -7}, {5, 6, 7}}));
    fs::create_directory(folder_.path() / "debug");
    write("vantage_export.json", "{}");
  }
  void write(const std::string& name, const std::string& content) const {
    write_text(folder_.path() / name, content);
  }
  [[nodiscard]] fs::path path(const std::string& name = "") const { return folder_.path() / name; }
  [[nodiscard]] PluginPtr<MapStore> store() const {
    return test::plugin<MapStore>("grid_pcd", "root = '" + folder_.path().string() + "'");
  }
  /// Opening the folder fails, and the message has these parts.
  void check_refused(std::initializer_list<std::string> parts,
                     ErrorCode code = ErrorCode::corrupt_data) const {
    const auto opened = store()->open();
    REQUIRE_FALSE(opened.has_value());
    CHECK(opened.error().code == code);
    for (const std::string& part : parts) {
      CHECK_MESSAGE(to_string(opened.error()).find(part) != std::string::npos,
                    to_string(opened.error()));
    }
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_CASE("grid_pcd: the cells that have a file are the regions, by rows, with their points") {
  const Folder folder;
  const auto bundle = test::opened(folder.store());
  const auto index = bundle->index();
  REQUIRE_MESSAGE(index, to_string(index.error()));
  REQUIRE(index->partition.size() == 3);
  const auto& regions = index->partition.regions();
  CHECK(regions[0].label == "grid_0_0");
  CHECK(regions[1].label == "grid_2_0");
  CHECK(regions[2].label == "grid_1_1");
  CHECK(std::get<HalfOpenBox>(regions[0].footprint) == HalfOpenBox{{-41.5, 10}, {-21.5, 30}});
  CHECK(std::get<HalfOpenBox>(regions[2].footprint) == HalfOpenBox{{-21.5, 30}, {-1.5, 50}});
  CHECK(index->partition.locate(Eigen::Vector2d(-1.5, 12)) == RegionId{1});
  CHECK_FALSE(index->partition.locate(Eigen::Vector2d(-41, 31)));
  CHECK(index->regions[0].points == 3);
  CHECK(index->regions[0].viewpoints == 0);
  CHECK(index->regions[1].bytes == fs::file_size(folder.path("grid_2_0.pcd")));
  CHECK(index->map_bounds.min == Point(-41, -70.5, -7));
  CHECK(index->map_bounds.max == Point(200, 11, 7));
  CHECK(index->config.empty());

  const auto map = bundle->get(RegionId{0});
  REQUIRE_MESSAGE(map, to_string(map.error()));
  CHECK(map->points == PointCloud{{-41, 11, 0}, {200, -70.5, 3}, {-41, 11, 0}});
  CHECK(bundle->get(RegionId{2})->points[0] == Point(0.1F, 0.2F, -7));
  const auto text = bundle->attachment("grid_meta_data");
  REQUIRE(text);
  CHECK(std::string(reinterpret_cast<const char*>(text->data()), text->size()) == kMetaData);
  CHECK(bundle->attachment("places").error().code == ErrorCode::not_found);
}

TEST_CASE("grid_pcd: no folder, no files of it, or one of both kinds") {
  const test::TemporaryFolder empty;
  const auto none = [](const fs::path& root) {
    const auto opened =
        test::open(test::plugin<MapStore>("grid_pcd", "root = '" + root.string() + "'"));
    REQUIRE_FALSE(opened.has_value());
    CHECK(opened.error().code == ErrorCode::not_found);
    CHECK(opened.error().message.find("no grid_meta_data.yaml") != std::string::npos);
  };
  none(empty.path());
  none(empty.path() / "nowhere");

  const Folder folder;
  fs::remove(folder.path("grid_meta_data.yaml"));
  folder.check_refused({"grid_meta_data.yaml is missing; expected it beside grid_0_0.pcd"});
  folder.write("grid_meta_data.yaml", kMetaData);
  for (const char* file : {"grid_0_0.pcd", "grid_2_0.pcd", "grid_1_1.pcd"}) {
    fs::remove(folder.path(file));
  }
  folder.check_refused({"there is a grid_meta_data.yaml, but no grid_<i>_<j>.pcd"});
}

TEST_CASE("grid_pcd: a file with a wrong name is told") {
  for (const std::string name :
       {"grid_1.pcd", "grid_1_2_3.pcd", "grid_-1_0.pcd", "grid_01_0.pcd", "grid_a_b.pcd",
        "grid__1.pcd", "grid_.pcd", "grid_1_0 .pcd", "grid_99999999999_0.pcd"}) {
    const Folder folder;
    folder.write(name, cell_file({{1, 2, 3}}));
    folder.check_refused({name + ": error: is not named grid_<i>_<j>.pcd", "as in grid_3_0.pcd"});
  }
  const Folder folder;
  folder.write("grid_5_0.pcd", cell_file({{1, 2, 3}}));
  folder.check_refused(
      {"grid_5_0.pcd: error: cell 5, 0 lies beyond max_pt", "expected indices below 3, 2"});
  for (const std::string name :
       {"grid_0_0.pcd.bak", "agrid_0_0.pcd", "grid_0_0.PCD", "notes.txt"}) {
    const Folder with_more;
    with_more.write(name, "what is no cell's file does not matter");
    CHECK(test::index_in(with_more.store()));
  }
}

TEST_CASE("grid_pcd: the meta data says where it is wrong") {
  const auto refused = [](const std::string& text, const std::string& message) {
    CAPTURE(text);
    const Folder folder;
    folder.write("grid_meta_data.yaml", text);
    folder.check_refused({"grid_meta_data.yaml", message});
  };
  const std::string corners = "min_pt:\n  x: 0\n  y: 0\nmax_pt:\n  x: 50\n  y: 50\n";
  refused(corners, "missing key 'grid_size'");
  refused("grid_size: 20\nmin_pt:\n  x: 0\n  y: 0\nmax_pt:\n  x: 50\n", "missing key 'max_pt: y'");
  refused("grid_size: twenty\n" + corners,
          ":1: error: 'grid_size' must be a finite number, not 'twenty'");
  refused("grid_size: nan\n" + corners, "'grid_size' must be a finite number");
  refused("grid_size: 20 m\n" + corners, "not '20 m'");
  refused("grid_size:\n" + corners, "must be a finite number, not ''");
  refused("grid_size: 0\n" + corners, "'grid_size' must be above 0 m");
  refused("grid_size: -20\n" + corners, "'grid_size' must be above 0 m");
  refused("grid_size: 20\ngrid_size: 20\n" + corners, ":2: error: 'grid_size' is given twice");
  refused("grid_size: 20\nmin_pt:\n  x: 0\n  x: 1\n", ":4: error: 'x' is given twice");
  refused("grid_size: 20\ngrid: 1\n" + corners, ":2: error: unknown key 'grid'; known are");
  refused("grid_size: 20\nmin_pt:\n  z: 0\n", ":3: error: unknown key 'z'");
  refused("grid_size: 20\n  x: 0\n", ":2: error: unknown key 'x'");
  refused("grid_size: 20\nmin_pt: 5\n", ":2: error: expected the lines");
  refused("grid_size: 20\nhello\n", ":2: error: expected 'key: value'");
  refused("grid_size: 20\nmin_pt:\n  x: 60\n  y: 0\nmax_pt:\n  x: 50\n  y: 50\n",
          "'min_pt' lies beyond 'max_pt'");
  refused("grid_size: 1e-20\nmin_pt:\n  x: 4\n  y: 4\nmax_pt:\n  x: 5\n  y: 5\n", "error");
  refused("", "is empty");
  refused("\n", "missing key 'grid_size'");

  const Folder folder;
  folder.write("grid_meta_data.yaml",
               "# the grid\r\ngrid_size: 2e1  # L\r\n\r\nmax_pt:\r\n\tx: 8.25\r\n\ty: 49.5\r\n"
               "min_pt:\r\n  y: 10\r\n  x: -41.5\r\n");
  CHECK(test::index_in(folder.store()));
}

TEST_CASE("grid_pcd: a damaged file of a cell is told") {
  const std::string good = cell_file({{1, 2, 3}, {4, 5, 6}});
  const auto refused = [](const std::string& content, const std::string& message) {
    const Folder folder;
    folder.write("grid_0_1.pcd", content);
    folder.check_refused({"grid_0_1.pcd", message});
  };
  refused("", "is empty");
  refused("PCD", "the header is not that of a binary PCD with the fields x y z in float32");
  refused(cell_file({{1, 2, 3}}, "x y i"), "the header is not that");
  refused(good.substr(0, 100), "the header is not that");
  refused(good.substr(0, good.size() - 1),
          "23 bytes of data, expected 12 for each of the 2 points");
  refused(good + "x", "25 bytes of data");
  refused(good + std::string(12, 'x'), "36 bytes of data");
  std::string many = good;
  for (std::size_t at = 0; (at = many.find(" 2\n")) != std::string::npos;) {
    many.replace(at, 3, " 18446744073709551615\n");
  }
  refused(many, "24 bytes of data, expected 12 for each of the 18446744073709551615 points");
  refused(cell_file({{1, 2, 3}, {1, std::numeric_limits<float>::quiet_NaN(), 3}}),
          "a coordinate of point 1 is not finite");
  const Folder folder;
  fs::create_directory(folder.path("grid_0_1.pcd"));
  folder.check_refused({"grid_0_1.pcd"}, ErrorCode::io_failure);
}

TEST_CASE("grid_pcd: no damaged header or meta data crashes or reads past the end") {
  std::mt19937 random(11);
  for (const std::string name : {"grid_0_0.pcd", "grid_meta_data.yaml"}) {
    const Folder folder;
    const std::string good = test::read_text(folder.path(name));
    for (int round = 0; round < 400; ++round) {
      std::string bad = good;
      for (int n = 0; n < 1 + round % 3; ++n) {
        bad[random() % bad.size()] = static_cast<char>(random() % 256);
      }
      if (round % 5 == 0) bad.resize(random() % bad.size());
      folder.write(name, bad);
      const auto index = test::index_in(folder.store());
      if (index) CHECK(index->partition.size() == 3);
    }
  }
}

TEST_CASE("grid_pcd: what changes or goes after the folder was opened is told, never mixed") {
  const Folder folder;
  const auto bundle = test::opened(folder.store());
  folder.write("grid_2_0.pcd", cell_file({{1, 2, 4}}));
  const auto changed = bundle->get(RegionId{1});
  REQUIRE_FALSE(changed.has_value());
  CHECK(changed.error().code == ErrorCode::corrupt_data);
  CHECK(changed.error().message == "has changed since the folder was opened");
  fs::remove(folder.path("grid_2_0.pcd"));
  const auto gone = bundle->get(RegionId{1});
  REQUIRE_FALSE(gone.has_value());
  CHECK(gone.error().message.find("is missing") == 0);
  CHECK(bundle->get(RegionId{0}));
}

TEST_CASE("grid_pcd only reads") {
  const Folder folder;
  const auto store = folder.store();
  CHECK(store->may_begin().error().code == ErrorCode::unsupported);
  const auto begun = store->begin(MapIndex{});
  REQUIRE_FALSE(begun.has_value());
  CHECK(begun.error().code == ErrorCode::unsupported);
  CHECK(begun.error().message.find("vantage export grid") != std::string::npos);
  CHECK(test::plugin<MapStore>("pcd_tiles", "root = '" + folder.path("new").string() + "'")
            ->may_begin());
}

}  // namespace
}  // namespace vantage
