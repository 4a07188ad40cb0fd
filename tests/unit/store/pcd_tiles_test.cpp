#include <doctest/doctest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <random>
#include <span>
#include <thread>

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

TEST_CASE("a bundle holds its index and one PCD file a region, and nothing else") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  CHECK(files_in(root) == std::vector<std::string>{"index.json", "regions.idx", "storey.1.pcd",
                                                   "storey.2.pcd", "x+000_y+000.pcd"});
  CHECK(files_in(folder.path()) == std::vector<std::string>{"bundle"});
}

TEST_CASE("the index comes back exactly") {
  const test::TemporaryFolder folder;
  const MapIndex written = sample_index();
  write_bundle(pcd_tiles_at(folder.path() / "bundle"), written, sample_maps());
  const auto read = index_in(pcd_tiles_at(folder.path() / "bundle"));
  REQUIRE_MESSAGE(read, to_string(read.error()));
  CHECK(read->config == written.config);
  CHECK(read->map_points == written.map_points);
  CHECK(read->map_bounds.min == written.map_bounds.min);
  CHECK(std::signbit(read->map_bounds.min.z()));
  CHECK(read->map_bounds.max == written.map_bounds.max);
  CHECK(read->partition.regions() == written.partition.regions());
  REQUIRE(read->regions.size() == 3);
  CHECK(read->regions[0].points == 1000);
  CHECK(read->regions[0].viewpoints == 7);
  CHECK(read->regions[0].elements == 0);
  CHECK(read->regions[2].viewpoints == 3);
  CHECK(read->regions[2].elements == 4'000'000'000U);
  for (std::size_t r = 0; r < 3; ++r) {
    const auto file = folder.path() / "bundle" / (written.partition.regions()[r].label + ".pcd");
    CHECK(read->regions[r].bytes == fs::file_size(file));
  }
}

TEST_CASE("random partition edges come back bit for bit") {
  const test::TemporaryFolder folder;
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> exponent(-12.0, 12.0), mantissa(-1.0, 1.0);
  const auto edge = [&] { return mantissa(random) * std::pow(10.0, exponent(random)); };
  std::vector<Region> regions;
  for (int r = 0; r < 500; ++r) {
    Eigen::Vector2d a(edge(), edge()), b(edge(), edge());
    regions.push_back({"r" + std::to_string(r), HalfOpenBox{a.cwiseMin(b), a.cwiseMax(b)}, {}});
  }
  BoxUnion all;
  for (const Region& region : regions) all.boxes.push_back(std::get<HalfOpenBox>(region.footprint));
  regions.push_back({"all", all, {}});
  MapIndex index;
  index.partition = Partition::from(regions).value();
  write_bundle(pcd_tiles_at(folder.path() / "bundle"), index, std::vector<RegionMap>(501));
  const auto read = index_in(pcd_tiles_at(folder.path() / "bundle"));
  REQUIRE_MESSAGE(read, to_string(read.error()));
  CHECK(read->partition.regions() == regions);
  CHECK(read->map_bounds.empty());  // of no points: infinite the wrong way round
}

TEST_CASE("points come back in their order, to the stated precision, far from the origin too") {
  MapIndex index;
  index.partition = Partition::from({{"map", HalfOpenBox{{-1e7, -1e7}, {1e7, 1e7}}, {}}}).value();
  for (const Point& centre : {Point(0, 0, 0), Point(3.25, -1e6, 40), Point(5e6, -5e6, 3000)}) {
    for (const double extent : {0.01, 1.0, 30.0, 200.0, 5000.0}) {
      CAPTURE(extent);
      const test::TemporaryFolder folder;
      const RegionMap written{
          random_cloud(2000, centre, extent), random_cloud(300, centre, extent), {}};
      write_bundle(pcd_tiles_at(folder.path() / "b"), index, {written});
      const auto read = map_in(pcd_tiles_at(folder.path() / "b"), 0);
      REQUIRE_MESSAGE(read, to_string(read.error()));
      const double rounding = centre.cwiseAbs().maxCoeff() * 0x1p-52;
      const double precision = std::max(extent, 1.0) * 0x1p-24 + rounding;
      CHECK(worst(written.points, read->points) <= precision);
      CHECK(worst(written.viewpoints, read->viewpoints) <= precision);
    }
  }
}

TEST_CASE("a region without points, with one, and with equal ones") {
  const test::TemporaryFolder folder;
  const Point p(5e6 + 0.125, -7.5, 0.25);
  const std::vector<RegionMap> maps{{}, {{p}, {p}, {}}, {{p, p, p}, {p, p}, {}}};
  write_bundle(pcd_tiles_at(folder.path() / "b"), sample_index(), maps);
  const auto bundle = opened(pcd_tiles_at(folder.path() / "b"));
  for (std::uint32_t r = 0; r < 3; ++r) {
    const auto read = bundle->get(RegionId{r});
    REQUIRE_MESSAGE(read, to_string(read.error()));
    CHECK(read->points == maps[r].points);
    CHECK(read->viewpoints == maps[r].viewpoints);
  }
}

TEST_CASE("a file is a PCD that any tool reads, with the origin in a comment") {
  const test::TemporaryFolder folder;
  MapIndex index;
  index.partition = Partition::from({{"map", HalfOpenBox{{0, 0}, {9, 9}}, {}}}).value();
  write_bundle(pcd_tiles_at(folder.path() / "b"), index,
               {points_alone({{101.5, 20.0, -3.0}, {103.0, 20.5, -3.0}})});
  const std::string content = read_text(folder.path() / "b" / "map.pcd");
  const std::string header =
      "# .PCD v0.7 - Point Cloud Data file format\n# vantage origin 102 20 -3\nVERSION 0.7\n"
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA binary\n";
  REQUIRE(content.substr(0, header.size()) == header);
  REQUIRE(content.size() == header.size() + 24);
  float xyz[6];
  std::memcpy(xyz, content.data() + header.size(), sizeof xyz);
  CHECK(std::vector<float>(xyz, xyz + 6) == std::vector<float>{-0.5F, 0, 0, 1, 0.5F, 0});
}

TEST_CASE("viewpoints and prepared bytes lie behind the points, in the same file") {
  const test::TemporaryFolder folder;
  MapIndex index;
  index.partition = Partition::from({{"map", HalfOpenBox{{0, 0}, {9, 9}}, {}}}).value();
  const PreparedMap prepared{{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}, std::byte{5}},
                             2};
  write_bundle(pcd_tiles_at(folder.path() / "b"), index, {{{{2, 3, 4}}, {{2.5, 3, -1}}, prepared}});
  const std::string content = read_text(folder.path() / "b" / "map.pcd");
  const std::size_t data = content.find("DATA binary\n") + 12;
  CHECK(content.find("\nPOINTS 1\n") != std::string::npos);  // as a reader of PCD sees it
  REQUIRE(content.size() == data + 12 + 12 + 8);
  float xyz[6];
  std::memcpy(xyz, content.data() + data, sizeof xyz);
  CHECK(std::vector<float>(xyz, xyz + 6) == std::vector<float>{0, 0, 0, 0.5F, 0, -5});
  CHECK(content.substr(data + 24) == std::string("\1\2\3\4\5\0\0\0", 8));
  CHECK(map_in(pcd_tiles_at(folder.path() / "b"), 0)->prepared == prepared);
}

TEST_CASE("views are a field of the PCD") {
  const test::TemporaryFolder folder;
  RegionMap with = points_alone({{2, 3, 4}, {4, 3, 4}});
  with.viewpoints = {{2.5, 3, -1}};
  with.views = {7, 70'000};
  write_bundle(pcd_tiles_at(folder.path() / "b"), sample_index(),
               {with, {}, points_alone({{1, 2, 3}})});
  const std::string content = read_text(folder.path() / "b" / "x+000_y+000.pcd");
  CHECK(content.find("\nFIELDS x y z views\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n") !=
        std::string::npos);
  const std::size_t data = content.find("DATA binary\n") + 12;
  REQUIRE(content.size() == data + 16 + 16 + 12);
  std::uint32_t views = 0;
  std::memcpy(&views, content.data() + data + 28, sizeof views);
  CHECK(views == 70'000);
  const auto bundle = opened(pcd_tiles_at(folder.path() / "b"));
  CHECK(bundle->get(RegionId{0})->points == with.points);
  CHECK(bundle->get(RegionId{0})->viewpoints == with.viewpoints);
  CHECK(bundle->get(RegionId{0})->views == with.views);
  CHECK(bundle->get(RegionId{2})->views.empty());
  CHECK(bundle->index()->regions[0].max_views == 70'000);
  CHECK(bundle->index()->regions[2].max_views == 0);
}

TEST_CASE("views that are not one for each point, or 0, are refused") {
  const test::TemporaryFolder folder;
  const auto writer = begun(pcd_tiles_at(folder.path() / "b"), sample_index());
  RegionMap map = points_alone({{2, 3, 4}, {4, 3, 4}});
  map.views = {1};
  check_fails(writer->put(RegionId{0}, map), ErrorCode::invalid_input,
              "the region map has 1 views for 2 points");
  map.views = {1, 0};
  check_fails(writer->put(RegionId{0}, map), ErrorCode::invalid_input,
              "a point of the region map is seen from 0 viewpoints");
  CHECK(files_in(folder.path() / "b.partial").size() == 1);  // no file of a map that is refused
}

TEST_CASE("viewpoints and prepared bytes are kept without points") {
  const test::TemporaryFolder folder;
  const PointCloud viewpoints = random_cloud(20, {5e5, 2e6, 10}, 60.0);
  const std::vector<RegionMap> maps{
      {{}, viewpoints, some_prepared(7, 1)}, {{}, {}, some_prepared(8, 0)}, {{}, viewpoints, {}}};
  write_bundle(pcd_tiles_at(folder.path() / "b"), sample_index(), maps);
  const auto bundle = opened(pcd_tiles_at(folder.path() / "b"));
  for (std::uint32_t r = 0; r < 3; ++r) {
    const auto read = bundle->get(RegionId{r});
    REQUIRE_MESSAGE(read, to_string(read.error()));
    CHECK(read->points.empty());
    CHECK(worst(read->viewpoints, maps[r].viewpoints) < 4e-6);  // about their own centre
    CHECK(read->prepared == maps[r].prepared);
  }
  const auto index = bundle->index();
  REQUIRE(index);
  CHECK_FALSE(index->regions[0].empty());
  CHECK(index->regions[2].empty());
}

TEST_CASE("equal input gives equal bytes") {
  const test::TemporaryFolder folder;
  write_bundle(pcd_tiles_at(folder.path() / "a"), sample_index(), sample_maps());
  write_bundle(pcd_tiles_at(folder.path() / "b"), sample_index(), sample_maps());
  for (const std::string& name : files_in(folder.path() / "a")) {
    CHECK(read_text(folder.path() / "a" / name) == read_text(folder.path() / "b" / name));
  }
}

TEST_CASE("missing folders above the bundle are created, and removed again without a commit") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "out" / "deep" / "bundle";
  { const auto writer = begun(pcd_tiles_at(root), sample_index()); }
  CHECK(files_in(folder.path()).empty());
  write_bundle(pcd_tiles_at(root.string() + "/"), sample_index(), sample_maps());
  CHECK(index_in(pcd_tiles_at(root)));
}

TEST_CASE("before the commit there is no bundle, and without one nothing is left") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  {
    const auto writer = begun(pcd_tiles_at(root), sample_index());
    REQUIRE(writer->put(RegionId{0}, sample_maps()[0]));
    CHECK(!fs::exists(root));
    CHECK(fs::exists(root.string() + ".partial"));
    check_fails(pcd_tiles_at(root)->open(), ErrorCode::not_found, root.string());
  }
  CHECK(files_in(folder.path()).empty());
}

TEST_CASE("a wrong put and an early commit are errors") {
  const test::TemporaryFolder folder;
  const auto store = pcd_tiles_at(folder.path() / "bundle");
  check_fails(store->begin({}), ErrorCode::invalid_input, "needs a region");
  {
    const auto writer = begun(store, sample_index());
    check_fails(store->begin(sample_index()), ErrorCode::already_exists, "right now");
    REQUIRE(writer->put(RegionId{1}, {}));
    check_fails(writer->put(RegionId{1}, {}), ErrorCode::already_exists, "storey.1");
    check_fails(writer->put(RegionId{3}, {}), ErrorCode::not_found, "no region 3");
    check_fails(std::move(*writer).commit(), ErrorCode::invalid_input, "x+000_y+000");
  }
  CHECK(files_in(folder.path()).empty());
  write_bundle(store, sample_index(), std::vector<RegionMap>(3));
  check_fails(store->begin(sample_index()), ErrorCode::already_exists, "overwrite");
}

TEST_CASE("points that float32 cannot hold are refused and leave the region to be put") {
  const test::TemporaryFolder folder;
  const auto writer = begun(pcd_tiles_at(folder.path() / "bundle"), sample_index());
  const auto refused = [&](const PointCloud& points, const PointCloud& viewpoints,
                           const std::string& because) {
    check_fails(writer->put(RegionId{0}, {points, viewpoints, {}}), ErrorCode::invalid_input,
                because);
  };
  const Point p(1, 2, 3);
  refused({{0, std::nan(""), 0}}, {}, "a point of the region map is not finite");
  refused({{0, 0, kInfinity}}, {}, "a point of the region map is not finite");
  refused({p}, {p, {0, std::nan(""), 0}}, "a viewpoint of the region map is not finite");
  refused({}, {{-kInfinity, 0, 0}}, "a viewpoint of the region map is not finite");
  refused({{-1e39, 0, 0}, {1e39, 0, 0}}, {}, "float32");
  refused({}, {{-1e39, 0, 0}, {1e39, 0, 0}}, "float32");
  refused({p}, {p, {1e39, 0, 0}}, "float32");
  check_fails(writer->put(RegionId{0}, {{p}, {}, {.bytes = {}, .elements = 1}}),
              ErrorCode::invalid_input, "no bytes");
  CHECK(writer->put(RegionId{0}, {{p}, {p}, {}}));
}

TEST_CASE("a configuration that is not UTF-8 is refused before anything is written") {
  const test::TemporaryFolder folder;
  MapIndex index = sample_index();
  index.config = "name = '\xff\xfe'";
  check_fails(pcd_tiles_at(folder.path() / "b")->begin(index), ErrorCode::invalid_input, "UTF-8");
  CHECK(files_in(folder.path()).empty());
}

TEST_CASE("a bundle that is there is not touched without overwrite") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  const std::string before = read_text(root / "index.json");
  check_fails(pcd_tiles_at(root)->begin(sample_index()), ErrorCode::already_exists, root.string());
  CHECK(read_text(root / "index.json") == before);
  CHECK(files_in(folder.path()) == std::vector<std::string>{"bundle"});
}

/// Whether a reader of `regions` regions reads nothing of the bundle that is there now.
void check_replaced(const MapReader& reader, std::size_t regions) {
  const std::string because = "another bundle has been put in the place of the one that was opened";
  for (const std::uint32_t r : {0U, 1U, 2U}) {
    check_fails(reader.get(RegionId{r}), ErrorCode::io_failure, because);
  }
  check_fails(reader.attachment("places"), ErrorCode::io_failure, because);
  check_fails(reader.attach("atlas", {}), ErrorCode::io_failure, because);
  const auto index = reader.index();  // it holds the file open
  REQUIRE_MESSAGE(index, to_string(index.error()));
  CHECK(index->partition.size() == regions);
}

TEST_CASE("overwrite replaces a bundle at the commit and not before") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  MapIndex other;
  other.partition = Partition::from({{"new", HalfOpenBox{{0, 0}, {1, 1}}, {}}}).value();

  const auto reader = opened(pcd_tiles_at(root));
  REQUIRE(reader->get(RegionId{2}));
  {
    const auto abandoned = begun(pcd_tiles_at(root, true), other);
    REQUIRE(abandoned->put(RegionId{0}, points_alone({{1, 2, 3}})));
    CHECK(reader->get(RegionId{2}));
    CHECK(reader->index()->partition.size() == 3);
  }
  CHECK(reader->get(RegionId{2}));
  CHECK(files_in(folder.path()) == std::vector<std::string>{"bundle"});

  write_bundle(pcd_tiles_at(root, true), other, {points_alone({{1, 2, 3}})});
  CHECK(files_in(root) == std::vector<std::string>{"index.json", "new.pcd", "regions.idx"});
  CHECK(files_in(folder.path()) == std::vector<std::string>{"bundle"});
  const auto again = opened(pcd_tiles_at(root));
  CHECK(again->index()->partition.size() == 1);
  CHECK(again->get(RegionId{0})->points == PointCloud{{1, 2, 3}});
  check_fails(again->get(RegionId{2}), ErrorCode::not_found, "no region 2");
  check_replaced(*reader, 3);

  const auto owner = pcd_tiles_at(root, true);
  write_bundle(owner, sample_index(), sample_maps());
  CHECK(map_in(owner, 2)->points.size() == 10);
  check_replaced(*again, 1);
}

/// A rebuilt bundle that differs in one point only.
void check_reader_of_rebuilt(const char* plugin, std::size_t regions) {
  CAPTURE(plugin);
  CAPTURE(regions);
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  MapIndex index;
  std::vector<Region> boxes;
  for (std::size_t r = 0; r < regions; ++r) {
    const auto x = static_cast<double>(r);
    boxes.push_back({"r" + std::to_string(r), HalfOpenBox{{x, 0}, {x + 1, 1}}, {}});
  }
  index.partition = Partition::from(std::move(boxes)).value();
  const auto store =
      test::plugin<MapStore>(plugin, "root = '" + root.string() + "'\noverwrite = true");
  const auto build = [&](double height, const std::string& attached) {
    auto writer = begun(store, index);
    for (std::uint32_t r = 0; r < regions; ++r) {
      REQUIRE(writer->put(RegionId{r}, points_alone({{0.5 + r, 0.5, r == 1 ? height : 1.0}})));
    }
    REQUIRE(writer->attach("places", std::as_bytes(std::span(attached))));
    commit(std::move(writer));
  };
  build(2.0, "before");
  const auto reader = opened(store);
  const auto directory = reader->directory();
  REQUIRE_MESSAGE(directory, to_string(directory.error()));
  CHECK(reader->get(RegionId{1})->points.front().z() == 2.0);
  // Another bundle with the same regions, and another point in a region that is not asked for.
  build(3.0, "after");
  check_replaced(*reader, regions);
  CHECK((*directory)->entry(RegionId{1})->summary.points == 1);  // of the old one
  CHECK(fs::exists(root / "places.dat"));
  CHECK(map_in(store, 1)->points.front().z() == 3.0);
  // The old one again, from a copy: to the reader it is the one that it opened.
  build(2.0, "before");
  CHECK(reader->get(RegionId{1})->points.front().z() == 2.0);
  CHECK(reader->attachment("places")->size() == 6);
  // Touched, but not changed.
  fs::last_write_time(root / "index.json", fs::file_time_type::clock::now());
  CHECK(reader->get(RegionId{0}));
}

TEST_CASE("a reader whose bundle was replaced reads nothing of the other one") {
  for (const char* plugin : {"pcd_tiles", "shared_tiles"}) {
    for (const std::size_t regions : {3U, 300U}) check_reader_of_rebuilt(plugin, regions);
  }
}

TEST_CASE("a bundle that is replaced all the time gives the old one or an error, never a mixture") {
  for (const char* plugin : {"pcd_tiles", "shared_tiles"}) {
    CAPTURE(plugin);
    const test::TemporaryFolder folder;
    const fs::path root = folder.path() / "bundle";
    const auto store =
        test::plugin<MapStore>(plugin, "root = '" + root.string() + "'\noverwrite = true");
    const auto build = [&](double z) {
      const std::string attached(100, z == 1.0 ? 'a' : 'b');
      const auto writer = store->begin(sample_index());
      bool done = writer.has_value();
      for (std::uint32_t r = 0; done && r < 3; ++r) {
        done =
            (*writer)->put(RegionId{r}, points_alone(PointCloud(50, Point(0, 0, z)))).has_value();
      }
      done = done && (*writer)->attach("places", std::as_bytes(std::span(attached)));
      return done && std::move(**writer).commit();
    };
    REQUIRE(build(1.0));
    std::atomic<bool> stop{false};
    std::atomic<int> builds{0};
    std::thread rebuilder([&] {
      for (double z = 2.0; !stop; z = 3.0 - z) {
        if (build(z)) ++builds;
      }
    });
    int read = 0, refused = 0, mixed = 0;
    for (int round = 0; round < 2000 && (round < 200 || refused < 20 || read < 20); ++round) {
      const auto open = store->open();
      if (!open) {
        CHECK(open.error().code != ErrorCode::corrupt_data);  // nothing is damaged
        continue;
      }
      const auto& reader = *open;
      const auto first = reader->get(RegionId{0});
      if (!first) {
        CHECK(first.error().code != ErrorCode::corrupt_data);
        continue;
      }
      const double z = first->points.front().z();
      if (round % 2 == 1) {  // however busy the machine is, some readers outlive their bundle
        for (const int before = builds; builds == before;) std::this_thread::yield();
      }
      for (std::uint32_t r = 1; r < 8; ++r) {
        if (r % 2 == 0) {
          const auto attached = reader->attachment("places");
          if (attached) {
            ++read;
            if (attached->front() != static_cast<std::byte>(z == 1.0 ? 'a' : 'b')) ++mixed;
          } else {
            ++refused;
          }
          continue;
        }
        const auto map = reader->get(RegionId{r % 3});
        map ? ++read : ++refused;
        for (std::size_t k = 0; map && k < map->points.size(); ++k) {
          if (map->points[k].z() != z) ++mixed;
        }
      }
    }
    stop = true;
    rebuilder.join();
    CHECK(mixed == 0);
    CHECK(read >= 20);
    CHECK(refused >= 20);
    CHECK(builds > 1);
  }
}

TEST_CASE("what is not a bundle is never deleted, with or without overwrite") {
  for (const bool overwrite : {false, true}) {
    const test::TemporaryFolder folder;
    const fs::path root = folder.path() / "thing";
    const auto refused = [&](const std::string& because) {
      check_fails(pcd_tiles_at(root, overwrite)->begin(sample_index()), ErrorCode::already_exists,
                  because);
      CHECK(!fs::exists(root.string() + ".partial"));
    };
    SUBCASE("an empty folder") {
      fs::create_directory(root);
      refused("not a bundle");
      CHECK(fs::is_directory(root));
    }
    SUBCASE("a folder of the user") {
      fs::create_directory(root);
      write_text(root / "thesis.tex", "years of work");
      refused("not a bundle");
      CHECK(read_text(root / "thesis.tex") == "years of work");
    }
    SUBCASE("a folder with another program's index.json") {
      fs::create_directory(root);
      write_text(root / "index.json", "{\"name\": \"web page\"}");
      refused("'format'");
      CHECK(read_text(root / "index.json") == "{\"name\": \"web page\"}");
    }
    SUBCASE("a bundle with a pipe that has the name of an attachment") {
      write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
      REQUIRE(::mkfifo((root / "mine.dat").c_str(), 0600) == 0);
      refused("mine.dat");
      CHECK(fs::exists(root / "mine.dat"));
    }
    SUBCASE("a file") {
      write_text(root, "a file");
      refused("not a bundle");
      CHECK(read_text(root) == "a file");
    }
    SUBCASE("a link to nowhere") {
      fs::create_symlink(folder.path() / "nowhere", root);
      refused("not a bundle");
      CHECK(fs::is_symlink(root));
    }
    SUBCASE("a bundle that an older version has built") {
      write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
      const std::string index =
          replaced(read_text(root / "index.json"), "\"version\": 6", "\"version\": 5");
      write_text(root / "index.json", index);
      refused("built by an older version; remove it and build it again");
      CHECK(read_text(root / "index.json") == index);
    }
    SUBCASE("a bundle with a file of the user in it") {
      write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
      write_text(root / "notes.txt", "mine");
      refused("notes.txt");
      CHECK(read_text(root / "notes.txt") == "mine");
      CHECK(map_in(pcd_tiles_at(root), 0));
    }
  }
}

TEST_CASE("a bundle that gets a foreign file while its successor is written is kept") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  {
    const auto writer = begun(pcd_tiles_at(root, true), sample_index());
    for (std::uint32_t r = 0; r < 3; ++r) REQUIRE(writer->put(RegionId{r}, {}));
    write_text(root / "notes.txt", "mine");
    check_fails(std::move(*writer).commit(), ErrorCode::already_exists, "notes.txt");
  }
  CHECK(read_text(root / "notes.txt") == "mine");
  CHECK(map_in(pcd_tiles_at(root), 0)->points.size() == 1000);
  CHECK(files_in(folder.path()) == std::vector<std::string>{"bundle"});
}

TEST_CASE("something that takes the bundle's name while it is written is kept") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  {
    const auto writer = begun(pcd_tiles_at(root, true), sample_index());
    for (std::uint32_t r = 0; r < 3; ++r) REQUIRE(writer->put(RegionId{r}, {}));
    fs::create_directory(root);
    check_fails(std::move(*writer).commit(), ErrorCode::already_exists, "not a bundle");
  }
  CHECK(files_in(folder.path()) == std::vector<std::string>{"bundle"});
}

TEST_CASE("a bundle behind a symbolic link is replaced where it is") {
  const test::TemporaryFolder folder;
  write_bundle(pcd_tiles_at(folder.path() / "real"), sample_index(), sample_maps());
  fs::create_directory_symlink("real", folder.path() / "link");
  write_bundle(pcd_tiles_at(folder.path() / "link", true), sample_index(),
               std::vector<RegionMap>(3));
  CHECK(fs::is_symlink(folder.path() / "link"));
  CHECK(map_in(pcd_tiles_at(folder.path() / "real"), 0)->points.empty());
  CHECK(files_in(folder.path()) == std::vector<std::string>{"link", "real"});
}

TEST_CASE("what a killed run has left is cleared by the next one") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {  // ends without destructors, as a killed program does
    const auto writer = begun(pcd_tiles_at(root), sample_index());
    _exit(writer->put(RegionId{0}, sample_maps()[0]) ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  REQUIRE(WIFEXITED(status));
  REQUIRE(WEXITSTATUS(status) == 0);
  REQUIRE(fs::exists(fs::path(root.string() + ".partial") / "x+000_y+000.pcd"));

  MapIndex other;
  other.partition = Partition::from({{"new", HalfOpenBox{{0, 0}, {1, 1}}, {}}}).value();
  write_bundle(pcd_tiles_at(root), other, {RegionMap{}});
  CHECK(files_in(folder.path()) == std::vector<std::string>{"bundle"});
  CHECK(files_in(root) == std::vector<std::string>{"index.json", "new.pcd", "regions.idx"});
}

TEST_CASE("the folder of a bundle under construction is only cleared if it is one") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle", partial = folder.path() / "bundle.partial";
  SUBCASE("a folder of the user") {
    fs::create_directory(partial);
    write_text(partial / "half.txt", "mine");
    check_fails(pcd_tiles_at(root)->begin(sample_index()), ErrorCode::already_exists,
                partial.string());
    CHECK(read_text(partial / "half.txt") == "mine");
  }
  SUBCASE("a file") {
    write_text(partial, "mine");
    check_fails(pcd_tiles_at(root)->begin(sample_index()), ErrorCode::already_exists,
                "not a folder");
    CHECK(read_text(partial) == "mine");
  }
  SUBCASE("an empty folder, left by a run killed at its start") {
    fs::create_directory(partial);
    write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
    CHECK(!fs::exists(partial));
  }
  SUBCASE("a whole bundle of that name") {
    write_bundle(pcd_tiles_at(partial), sample_index(), sample_maps());
    check_fails(pcd_tiles_at(root)->begin(sample_index()), ErrorCode::already_exists,
                partial.string());
    CHECK(map_in(pcd_tiles_at(partial), 0));
  }
  SUBCASE("a whole bundle that was replaced, left by a run killed at its end") {
    write_bundle(pcd_tiles_at(partial), sample_index(), sample_maps());
    write_text(partial / ".vantage-partial", "");
    write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
    CHECK(!fs::exists(partial));
  }
}

TEST_CASE("two writers of one bundle do not get in each other's way") {
  const test::TemporaryFolder folder;
  const auto first = pcd_tiles_at(folder.path() / "b"), second = pcd_tiles_at(folder.path() / "b");
  auto writer = begun(first, sample_index());
  check_fails(second->begin(sample_index()), ErrorCode::already_exists, "right now");
  finish(std::move(writer), sample_maps());
  CHECK(map_in(second, 0));
}

TEST_CASE("no bundle and no region are not_found") {
  const test::TemporaryFolder folder;
  check_fails(pcd_tiles_at(folder.path() / "none")->open(), ErrorCode::not_found, "none");
  fs::create_directory(folder.path() / "empty");
  check_fails(pcd_tiles_at(folder.path() / "empty")->open(), ErrorCode::not_found, "index.json");
  write_bundle(pcd_tiles_at(folder.path() / "b"), sample_index(), sample_maps());
  check_fails(map_in(pcd_tiles_at(folder.path() / "b"), 3), ErrorCode::not_found, "0 to 2");
  check_fails(map_in(pcd_tiles_at(folder.path() / "b"), 4'294'967'295U), ErrorCode::not_found,
              "no region");
}

TEST_CASE("a damaged region file is corrupt_data that names the file") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle", file = root / "x+000_y+000.pcd";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  const std::string good = read_text(file);
  const auto bundle = opened(pcd_tiles_at(root));
  const auto corrupt = [&](const std::string& because) {
    check_fails(bundle->get(RegionId{0}), ErrorCode::corrupt_data, because);
    check_fails(bundle->get(RegionId{0}), ErrorCode::corrupt_data, file.string());
    CHECK(bundle->get(RegionId{2}));  // the others are as good as before
  };
  SUBCASE("missing") {
    fs::remove(file);
    corrupt("missing");
  }
  SUBCASE("cut short") {
    write_text(file, good.substr(0, good.size() - 1));
    corrupt("expected " + std::to_string(good.size()));
  }
  SUBCASE("empty") {
    write_text(file, "");
    corrupt("0 bytes");
  }
  SUBCASE("too long") {
    write_text(file, good + "x");
    corrupt("bytes");
  }
  SUBCASE("another header of the same length") {
    write_text(file, replaced(good, "FIELDS x y z", "FIELDS z y x"));
    corrupt("header");
  }
  SUBCASE("any bit flipped") {
    const std::size_t data = good.find("DATA binary\n") + 12;
    std::mt19937 random(8);
    for (int n = 0; n < 200; ++n) {
      std::string bad = good;
      char& byte = bad[data + random() % (bad.size() - data)];
      byte = static_cast<char>(byte ^ (1 << (random() % 8)));
      write_text(file, bad);
      corrupt("checksum");
    }
  }
  SUBCASE("any bit flipped of the viewpoints, the prepared bytes and their padding") {
    const fs::path other = root / "storey.2.pcd";
    const std::string whole = read_text(other);
    const std::size_t behind = whole.find("DATA binary\n") + 12 + 10 * 12;
    REQUIRE(whole.size() == behind + 3 * 12 + 1236);
    std::mt19937 random(9);
    for (int n = 0; n < 200; ++n) {
      std::string bad = whole;
      const std::size_t at = n < 8 ? bad.size() - 1 - static_cast<std::size_t>(n % 2)
                                   : behind + random() % (bad.size() - behind);
      bad[at] = static_cast<char>(bad[at] ^ (1 << (random() % 8)));
      write_text(other, bad);
      check_fails(bundle->get(RegionId{2}), ErrorCode::corrupt_data, "checksum");
    }
  }
  SUBCASE("the file of another region") {
    fs::copy_file(root / "storey.1.pcd", file, fs::copy_options::overwrite_existing);
    corrupt("bytes");
  }
}

TEST_CASE("a region loads without touching the files of the others") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  fs::remove(root / "storey.1.pcd");
  write_text(root / "storey.2.pcd", "damaged");
  const auto bundle = opened(pcd_tiles_at(root));
  const auto index = bundle->index();
  REQUIRE_MESSAGE(index, to_string(index.error()));
  CHECK(index->partition.size() == 3);
  const auto map = bundle->get(RegionId{0});
  REQUIRE_MESSAGE(map, to_string(map.error()));
  CHECK(map->points.size() == 1000);
  check_fails(bundle->get(RegionId{1}), ErrorCode::corrupt_data, "missing");
  check_fails(bundle->get(RegionId{2}), ErrorCode::corrupt_data, "bytes");
}

TEST_CASE("a region of many blocks comes back whole, and thousands of regions do") {
  const test::TemporaryFolder folder;
  std::vector<Region> regions;
  for (int r = 0; r < 2000; ++r) {
    const double x = 2.7 * r;
    regions.push_back({"r" + std::to_string(r), HalfOpenBox{{x, 0.0}, {x + 2.7, 1.0}}, {}});
  }
  MapIndex index;
  index.partition = Partition::from(std::move(regions)).value();
  std::vector<RegionMap> maps(2000);
  for (const std::size_t n : {16'383U, 16'384U, 16'385U, 50'000U}) {
    maps[n % 7 + 100].points = random_cloud(n, {0, 0, 0}, 20.0);
  }
  maps[1998].viewpoints = random_cloud(40'000, {0, 0, 0}, 20.0);
  maps[1999] = {random_cloud(3, {1, 2, 3}, 1.0), random_cloud(9, {1, 2, 3}, 1.0),
                some_prepared(1'000'001, 5)};
  write_bundle(pcd_tiles_at(folder.path() / "bundle"), index, maps);
  const auto bundle = opened(pcd_tiles_at(folder.path() / "bundle"));
  REQUIRE(bundle->index());
  CHECK(bundle->index()->partition.regions() == index.partition.regions());
  for (const std::uint32_t r : {0U, 100U, 101U, 102U, 103U, 104U, 105U, 106U, 1998U, 1999U}) {
    const auto map = bundle->get(RegionId{r});
    REQUIRE_MESSAGE(map, to_string(map.error()));
    CHECK(worst(map->points, maps[r].points) < 2e-6);
    CHECK(worst(map->viewpoints, maps[r].viewpoints) < 2e-6);
    CHECK(map->prepared == maps[r].prepared);
  }
}

TEST_CASE("a folder in the place of a file is an error") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  write_bundle(pcd_tiles_at(root), sample_index(), sample_maps());
  fs::remove(root / "storey.2.pcd");
  fs::create_directory(root / "storey.2.pcd");
  check_fails(map_in(pcd_tiles_at(root), 2), ErrorCode::io_failure, "regular file");
}

TEST_CASE("a put that fails leaves no bundle") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle";
  {
    const auto writer = begun(pcd_tiles_at(root), sample_index());
    fs::create_directory(root.string() + ".partial/storey.1.pcd");  // nothing can be written there
    check_fails(writer->put(RegionId{1}, sample_maps()[2]), ErrorCode::io_failure, "storey.1.pcd");
    REQUIRE(writer->put(RegionId{0}, {}));
    REQUIRE(writer->put(RegionId{2}, {}));
    check_fails(std::move(*writer).commit(), ErrorCode::invalid_input, "storey.1");
  }
  CHECK(files_in(folder.path()).empty());
}

TEST_CASE("threads read one bundle at once") {
  const test::TemporaryFolder folder;
  const auto maps = sample_maps();
  write_bundle(pcd_tiles_at(folder.path() / "b"), sample_index(), maps);
  const auto bundle = opened(pcd_tiles_at(folder.path() / "b"));
  const PointCloud expected = map_in(pcd_tiles_at(folder.path() / "b"), 0)->points;
  std::vector<int> equal(4);
  std::vector<std::thread> threads;
  for (int& count : equal) {
    threads.emplace_back([&] {
      for (int n = 0; n < 50; ++n) {
        const auto map = bundle->get(RegionId{0});
        count += map && map->points == expected && bundle->index() ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(equal == std::vector<int>(4, 50));
}

TEST_CASE("bad parameters are refused") {
  for (const std::string params : {"", "root = ''", "root = '.'", "root = '/'", "root = 'a/..'",
                                   "root = 5", "root = 'b'\noverwrite = 1", "roots = 'b'"}) {
    CAPTURE(params);
    CHECK_THROWS((void)test::plugin<MapStore>("pcd_tiles", params));
  }
}

}  // namespace
}  // namespace vantage
