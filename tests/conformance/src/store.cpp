// S: the contract of a MapStore.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "clauses.hpp"
#include "store_bundles.hpp"
#include "vantage/region_directory.hpp"

namespace vantage::conformance {
namespace {

namespace fs = std::filesystem;

void points(const Subject& subject) {
  Random random(subject.seed());
  Bundle bundle;
  std::vector<Region> regions;
  const std::array<Point, 3> centres{Point(0, 0, 0), Point(1e6, -1e6, 100), Point(-1e6, 5e6, 300)};
  for (const Point& c : centres) {
    const Eigen::Vector2d xy = c.head<2>(), half = {51, 51};
    regions.push_back(
        {"region_" + std::to_string(regions.size()), HalfOpenBox{xy - half, xy + half}, {}});
    const Point low = c - Point(50, 50, 10), high = c + Point(50, 50, 10);
    PointCloud cloud = random_cloud(random, 500, low, high);
    cloud.insert(cloud.begin() + 7, {high, low});
    bundle.maps.push_back({std::move(cloud), {}, {}});
  }
  bundle.index = index_of(std::move(regions));
  const Place place(subject);
  finish(place.begin(subject, bundle), bundle);
  check_kept(bundle, *place.open(subject), subject.claims<StoreClaims>().precision);
}

void commits(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  const auto nothing_there = [&] { CHECK_FALSE(place.store(subject)->open().has_value()); };
  {
    const Writer writer = place.begin(subject, bundle);
    nothing_there();
    put_all(*writer, bundle);
    nothing_there();
  }
  nothing_there();
  for (const auto& left : fs::directory_iterator(place.folder())) {
    FAIL_CHECK("a writer that went without a commit left " << left.path().filename());
  }
  Writer writer = place.begin(subject, bundle);
  put_all(*writer, bundle);
  nothing_there();
  commit(std::move(writer));
  check_kept(subject, bundle, *place.open(subject));
}

void unknown_region(const Subject& subject) {
  const Place place(subject);
  place_bundle(subject, place);
  const Reader reader = place.open(subject);
  const auto regions = static_cast<std::uint32_t>(index_in(*reader).regions.size());
  for (const std::uint32_t r : {regions, regions + 1U, 1U << 31U, ~0U}) {
    CAPTURE(r);
    check_fails(reader->get(RegionId{r}), ErrorCode::not_found);
  }
}

void existing_bundle(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  finish(place.begin(subject, bundle), bundle);
  const auto before = files_below(place.folder());
  check_fails(place.store(subject)->begin(bundle.index), ErrorCode::already_exists);
  check_fails(place.store(subject)->begin(index_of({{"other", HalfOpenBox{{0, 0}, {1, 1}}, {}}})),
              ErrorCode::already_exists);
  check_kept(subject, bundle, *place.open(subject));
  CHECK_MESSAGE(files_below(place.folder()) == before, "its files have changed");
}

void may_begin(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  require(place.store(subject)->may_begin(), "may_begin without a bundle");
  CHECK_MESSAGE(fs::is_empty(place.folder()), "may_begin has left something");
  finish(place.begin(subject, bundle), bundle);
  const auto before = files_below(place.folder());
  const auto told = place.store(subject)->may_begin();
  CHECK_MESSAGE(files_below(place.folder()) == before, "its files have changed");
  if (told) return;
  CHECK(told.error().code == ErrorCode::already_exists);
  CHECK_FALSE(place.store(subject)->begin(bundle.index).has_value());
}

/// What the directory says of a region.
Result<DirectoryEntry> entry_in(const MapReader& reader, RegionId region) {
  VANTAGE_TRY(const auto directory, reader.directory());
  return directory->entry(region);
}

void concurrent(const Subject& subject) {
  const Place place(subject);
  const std::vector<std::byte> beside = [&] {
    Random random(subject.seed());
    return some_prepared(random, 1000, 1).bytes;
  }();
  if (only_reads(subject)) {
    place_bundle(subject, place);
  } else {
    const Bundle bundle = some_bundle(subject);
    Writer writer = place.begin(subject, bundle);
    static_cast<void>(writer->attach("beside", beside));  // a store may keep none
    finish(std::move(writer), bundle);
  }
  const Reader reader = place.open(subject);
  const MapIndex index = index_in(*reader);
  const Result<std::vector<std::byte>> attachment = reader->attachment("beside");
  std::vector<RegionMap> maps;
  std::vector<DirectoryEntry> contents;
  for (std::uint32_t r = 0; r < 3; ++r) {
    maps.push_back(get(*reader, r));
    auto entry = entry_in(*reader, RegionId{r});
    REQUIRE_MESSAGE(entry, to_string(entry.error()));
    contents.push_back(*std::move(entry));
  }
  constexpr std::size_t kThreads = 4;
  for (int round = 0; round < 5; ++round) {
    const auto fresh = place.open(subject);  // nothing has been read through it yet
    std::vector<Result<RegionMap>> got(kThreads);
    std::vector<Result<MapIndex>> read(kThreads);
    std::vector<Result<DirectoryEntry>> entries(kThreads);
    std::vector<Result<std::vector<std::byte>>> attached(kThreads);
    at_once(kThreads, [&](std::size_t i) {
      const RegionId region{static_cast<std::uint32_t>(i % 3)};
      entries[i] = entry_in(*fresh, region);
      attached[i] = fresh->attachment("beside");
      got[i] = fresh->get(region);
      read[i] = fresh->index();
    });
    for (std::size_t i = 0; i < kThreads; ++i) {
      REQUIRE_MESSAGE(got[i], to_string(got[i].error()));
      REQUIRE_MESSAGE(read[i], to_string(read[i].error()));
      CHECK(same(*got[i], maps[i % 3]));
      CHECK(same(*read[i], index));
      REQUIRE_MESSAGE(entries[i], to_string(entries[i].error()));
      CHECK(entries[i]->region == contents[i % 3].region);
      CHECK(entries[i]->summary.points == contents[i % 3].summary.points);
      REQUIRE(attached[i].has_value() == attachment.has_value());
      if (attachment) CHECK(*attached[i] == *attachment);
    }
  }
}

void damage(const Subject& subject) {
  const Place place(subject);
  const Bundle bundle = some_bundle(subject);
  finish(place.begin(subject, bundle), bundle);
  const auto files = files_below(place.folder());
  if (files.empty()) FAIL("the store keeps no file below {folder}: there is nothing to damage");
  const MapIndex index = index_in(*place.open(subject));
  std::vector<RegionMap> maps;
  for (std::uint32_t r = 0; r < 3; ++r) maps.push_back(get(*place.open(subject), r));

  const auto check_reads = [&](const fs::path& file, const std::string& how) {
    CAPTURE(file.string());
    CAPTURE(how);
    const auto store = place.store(subject);
    const auto reader = store->open();
    if (!reader) return;
    const auto read = (*reader)->index();
    REQUIRE_MESSAGE((!read || same(*read, index)), "the index is read and wrong");
    check_directory_reads(**reader, index);
    for (std::uint32_t r = 0; r < 3; ++r) {
      const auto map = (*reader)->get(RegionId{r});
      REQUIRE_MESSAGE((!map || same(*map, maps[r])), "region " << r << " is read and wrong");
    }
  };
  Random random(subject.seed() + 1);
  for (const auto& [file, good] : files) {
    for (const Damaged& damaged : damages(random, good)) {
      write_file(place.folder() / file, damaged.content);
      check_reads(file, damaged.how);
    }
    fs::remove(place.folder() / file);
    check_reads(file, "missing");
    write_file(place.folder() / file, good);
  }
  check_reads("every file", "as it was");
  CHECK(same(index_in(*place.open(subject)), index));  // with its files put back
}

void not_finite(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  Writer writer = place.begin(subject, bundle);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      RegionMap map = bundle.maps[0];
      map.points[map.points.size() / 2][axis] = bad;
      check_fails(writer->put(RegionId{0}, map), ErrorCode::invalid_input);
      map = bundle.maps[0];
      map.viewpoints.back()[axis] = bad;
      check_fails(writer->put(RegionId{0}, map), ErrorCode::invalid_input);
    }
  }
  finish(std::move(writer), bundle);
  check_kept(subject, bundle, *place.open(subject));
}

void wrong_regions(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  Writer writer = place.begin(subject, bundle);
  for (const std::uint32_t r : {3U, ~0U}) {
    CAPTURE(r);
    check_fails(writer->put(RegionId{r}, bundle.maps[0]), ErrorCode::not_found);
  }
  require(writer->put(RegionId{0}, bundle.maps[0]), "put");
  check_fails(writer->put(RegionId{0}, bundle.maps[1]), ErrorCode::already_exists);
  require(writer->put(RegionId{1}, bundle.maps[1]), "put");
  require(writer->put(RegionId{2}, bundle.maps[2]), "put");
  commit(std::move(writer));
  check_kept(subject, bundle, *place.open(subject));
}

void missing_region(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  for (std::uint32_t missing = 0; missing < 3; ++missing) {
    CAPTURE(missing);
    const Place place(subject);
    Writer writer = place.begin(subject, bundle);
    for (std::uint32_t r = 0; r < 3; ++r) {
      if (r != missing) require(writer->put(RegionId{r}, bundle.maps[r]), "put");
    }
    check_refused(std::move(writer), ErrorCode::invalid_input);
    CHECK_FALSE(place.store(subject)->open().has_value());
    CHECK_MESSAGE(fs::is_empty(place.folder()), "a commit that failed has left something");
  }
}

/// Regions of every shape, with edges that no short decimal hits, and random boxes.
std::vector<Region> odd_regions(Random& random) {
  std::vector<Region> regions{
      {"x+000_y-000", HalfOpenBox{{0.1 + 0.2, -1.0 / 3.0}, {1e6 + 0.1, 5e6 + 1e-9}}, {}},
      {"storey.1", ConvexPolygon{{{0.0, 0.0}, {4.0, 0.1}, {1.0 / 7.0, 4.0}}}, {-2.5, 1.0 / 3.0}},
      {"storey.2", HalfOpenBox{{-5e-324, -1.0}, {1e-300, 1.0}}, {1.0 / 3.0, kInfinity}},
      {"Cellar", BoxUnion{{{{0, 0}, {0.7, 0.7}}, {{0.7, 0}, {1.4, 0.1}}}}, {-kInfinity, 1e-17}}};
  for (int r = 0; r < 50; ++r) {
    const double size = std::pow(10.0, random.uniform(-6.0, 7.0));
    const Eigen::Vector2d min(random.uniform(-size, 0.0), random.uniform(-size, 0.0));
    const Eigen::Vector2d max(random.uniform(0.1, size + 1.0), random.uniform(0.1, size + 1.0));
    regions.push_back({"r" + std::to_string(r), HalfOpenBox{min, max}, {min.x(), max.y()}});
  }
  return regions;
}

void index_exact(const Subject& subject) {
  Random random(subject.seed());
  Bundle bundle;
  bundle.index = index_of(odd_regions(random));
  bundle.index.config =
      "schema = 1 # \"quoted\" \\ 'text', \xc3\xa4 \xe5\x9c\xb0, \t tab\r\n\n[a]\n";
  bundle.index.map_points = (1ULL << 53U) + 1;  // the first number that no double holds exactly
  // The store must fill in what the index says about regions.
  bundle.index.regions.assign(bundle.index.partition.size(), {77, 77, 77, 77});
  for (std::size_t r = 0; r < bundle.index.partition.size(); ++r) {
    bundle.maps.push_back({random_cloud(random, r % 5, {0, 0, 0}, {1, 1, 1}),
                           random_cloud(random, r % 7, {0, 0, 0}, {1, 1, 1}),
                           {}});
  }
  const Bounds3 odd{Point(-1.0 / 3.0, 0.1, -0.0), Point(1e6, 5e6 + 0.1, 77.7)};
  for (const Bounds3& bounds : {odd, Bounds3{}}) {
    bundle.index.map_bounds = bounds;
    const Place place(subject);
    finish(place.begin(subject, bundle), bundle);
    const MapIndex read = index_in(*place.open(subject));
    CHECK(read.partition.regions() == bundle.index.partition.regions());
    CHECK(same_bits(read.map_bounds.min, bounds.min));
    CHECK(same_bits(read.map_bounds.max, bounds.max));
    CHECK(read.map_points == bundle.index.map_points);
    CHECK(read.config == bundle.index.config);
    REQUIRE(read.regions.size() == bundle.maps.size());
    for (std::size_t r = 0; r < bundle.maps.size(); ++r) {
      CAPTURE(r);
      CHECK(read.regions[r].points == bundle.maps[r].points.size());
      CHECK(read.regions[r].viewpoints == bundle.maps[r].viewpoints.size());
    }
  }
}

void few_points(const Subject& subject) {
  Bundle bundle = some_bundle(subject);
  const Point p(12.3, 4.56, 0.7);
  bundle.maps = {{{}, {}, {}}, {{p}, {p}, {}}, {PointCloud(50, p), {p, p}, {}}};
  const Place place(subject);
  finish(place.begin(subject, bundle), bundle);
  check_kept(subject, bundle, *place.open(subject));
}

void replaced(const Subject& subject) {
  const Bundle first = some_bundle(subject);
  Bundle second = first;
  std::ranges::rotate(second.maps, second.maps.begin() + 1);
  second.index.config = "schema = 1 # another\n";
  const std::array<std::byte, 2> ours{std::byte{1}, std::byte{2}}, others{std::byte{3}};
  const Place place(subject);
  const auto build = [&](const Bundle& bundle, std::span<const std::byte> beside) {
    Writer writer = place.begin(subject, bundle);
    static_cast<void>(writer->attach("beside", beside));  // a store may keep none
    finish(std::move(writer), bundle);
  };
  build(first, ours);
  const Reader reader = place.open(subject);
  const MapIndex index = index_in(*reader);
  std::vector<RegionMap> maps;
  std::vector<std::uint64_t> points;  // as the directory says
  for (std::uint32_t r = 0; r < 3; ++r) {
    maps.push_back(get(*reader, r));
    const auto entry = entry_in(*reader, RegionId{r});
    REQUIRE_MESSAGE(entry, to_string(entry.error()));
    points.push_back(entry->summary.points);
  }
  for (const auto& file : fs::directory_iterator(place.folder())) fs::remove_all(file);
  build(second, others);
  for (std::uint32_t r = 0; r < 3; ++r) {
    const auto map = reader->get(RegionId{r});
    CHECK_MESSAGE((!map || same(*map, maps[r])), "region " << r << " is that of another bundle");
    const auto entry = entry_in(*reader, RegionId{r});
    if (entry) CHECK(entry->summary.points == points[r]);
  }
  const auto read = reader->index();
  CHECK_MESSAGE((!read || same(*read, index)), "the index is that of another bundle");
  const auto beside = reader->attachment("beside");
  CHECK_MESSAGE((!beside || std::ranges::equal(*beside, ours)), "bytes of another bundle");
  check_kept(subject, second, *place.open(subject));
}

void no_bundle(const Subject& subject) {
  check_fails(Place(subject).store(subject)->open(), ErrorCode::not_found);
}

void check_same_files(const std::map<fs::path, std::string>& a,
                      const std::map<fs::path, std::string>& b) {
  for (const auto& [file, content] : a) {
    const auto other = b.find(file);
    REQUIRE_MESSAGE(other != b.end(), file.string() << " is in one place only");
    CHECK_MESSAGE(other->second == content, file.string() << " differs");
  }
  CHECK(a.size() == b.size());
}

void same_bytes(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  const Place first(subject), second(subject);
  finish(first.begin(subject, bundle), bundle);
  Writer writer = second.begin(subject, bundle);
  for (const std::uint32_t r : {2U, 0U, 1U}) {
    require(writer->put(RegionId{r}, bundle.maps[r]), "put");
  }
  commit(std::move(writer));

  check_same_files(files_below(first.folder()), files_below(second.folder()));
}

void any_threads(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  std::optional<std::map<fs::path, std::string>> expected;
  with_threads([&] {
    const Place place(subject);
    finish(place.begin(subject, bundle), bundle);
    const auto files = files_below(place.folder());
    if (!expected) expected = files;
    check_same_files(*expected, files);
    check_kept(subject, bundle, *place.open(subject));
  });
}

/// Also far from the origin, and with each part of a region map missing.
void viewpoints_and_prepared(const Subject& subject) {
  Random random(subject.seed());
  Bundle bundle;
  std::vector<Region> regions;
  const auto add = [&](const Point& c, std::size_t points, std::size_t viewpoints,
                       const PreparedMap& prepared) {
    const Eigen::Vector2d xy = c.head<2>(), half = {51, 51};
    regions.push_back(
        {"region_" + std::to_string(regions.size()), HalfOpenBox{xy - half, xy + half}, {}});
    const Point low = c - Point(50, 50, 10), high = c + Point(50, 50, 10);
    bundle.maps.push_back({random_cloud(random, points, low, high),
                           random_cloud(random, viewpoints, low, high), prepared});
  };
  for (const Point& c : {Point(0, 0, 0), Point(1e6, -1e6, 100), Point(-1e6, 5e6, 300)}) {
    add(c, 100, 50, some_prepared(random, 1000 + random.below(1000), random.below(1000)));
    add(c, 0, 50, some_prepared(random, 1 + random.below(1000), (1ULL << 53U) + 1));
    add(c, 100, 0, some_prepared(random, 1 + random.below(1000), 1));
  }
  for (std::size_t bytes = 0; bytes < 10; ++bytes) {
    add({0, 0, 0}, 0, 0, some_prepared(random, bytes, bytes));
  }
  add({0, 0, 0}, 1, 1, {std::vector<std::byte>(100), 7});  // zeros are bytes, too
  bundle.index = index_of(std::move(regions));

  const Place place(subject);
  finish(place.begin(subject, bundle), bundle);
  const Reader reader = place.open(subject);
  const MapIndex index = index_in(*reader);
  REQUIRE(index.regions.size() == bundle.maps.size());
  for (std::uint32_t r = 0; r < bundle.maps.size(); ++r) {
    CAPTURE(r);
    const RegionMap& put = bundle.maps[r];
    const RegionMap got = get(*reader, r);
    CHECK(got.points.size() == put.points.size());
    check_points_kept(put.viewpoints, got.viewpoints, subject.claims<StoreClaims>().precision);
    CHECK_MESSAGE(got.prepared.bytes == put.prepared.bytes, "the prepared bytes differ");
    CHECK(got.prepared.elements == put.prepared.elements);
    CHECK(index.regions[r].viewpoints == put.viewpoints.size());
    CHECK(index.regions[r].elements == put.prepared.elements);
  }
}

void views(const Subject& subject) {
  Random random(subject.seed());
  Bundle bundle = some_bundle(subject);
  constexpr std::array<std::uint32_t, 3> kMost{1, 300, std::numeric_limits<std::uint32_t>::max()};
  for (std::size_t r = 0; r < kMost.size(); ++r) {
    bundle.maps[r].views = some_views(random, bundle.maps[r].points.size(), kMost[r]);
  }
  const Place place(subject);
  Writer writer = place.begin(subject, bundle);
  RegionMap wrong = bundle.maps[0];
  wrong.views.pop_back();
  check_fails(writer->put(RegionId{0}, wrong), ErrorCode::invalid_input);
  wrong.views.push_back(0);
  check_fails(writer->put(RegionId{0}, wrong), ErrorCode::invalid_input);
  finish(std::move(writer), bundle);

  const Reader reader = place.open(subject);
  const MapIndex index = index_in(*reader);
  REQUIRE(index.regions.size() == bundle.maps.size());
  for (std::uint32_t r = 0; r < bundle.maps.size(); ++r) {
    CAPTURE(r);
    CHECK_MESSAGE(get(*reader, r).views == bundle.maps[r].views, "the views differ");
    CHECK(index.regions[r].max_views == kMost[r]);
  }
}

}  // namespace

void read_only_refuses(const Subject& subject) {
  const Place place(subject);
  const Bundle bundle = some_bundle(subject);
  if (!only_reads(subject)) {
    static_cast<void>(place.begin(subject, bundle));
    return;
  }
  const auto refuses_to_begin = [&] {
    const auto before = files_below(place.folder());
    check_fails(place.store(subject)->begin(bundle.index), ErrorCode::unsupported);
    CHECK_MESSAGE(files_below(place.folder()) == before, "its files have changed");
  };
  refuses_to_begin();
  place_bundle(subject, place);
  const auto before = files_below(place.folder());
  for (int round = 0; round < 2; ++round) {
    refuses_to_begin();
    check_fails(place.open(subject)->attach("places", {}), ErrorCode::unsupported);
  }
  CHECK_MESSAGE(files_below(place.folder()) == before, "its files have changed");
}

namespace {

/// The check of a clause that writes a bundle.
template <void (*kCheck)(const Subject&)>
void written(const Subject& subject) {
  if (only_reads(subject)) does_not_apply("the store only reads");
  kCheck(subject);
}

constexpr std::array kClauses{
    Clause{"S1", "points come back in order and as accurately as claimed, also far from the origin",
           &written<&points>},
    Clause{"S2",
           "a bundle exists only after the commit, and complete; without a commit nothing is left",
           &written<&commits>},
    Clause{"S3", "an unknown region is not_found", &unknown_region},
    Clause{"S4", "begin on an existing bundle is already_exists, and the bundle stays unchanged",
           &written<&existing_bundle>},
    Clause{"S5", "concurrent calls on one object agree with calls one by one", &concurrent},
    Clause{"S6",
           "a damaged file is an error or gives the right data and directory, never wrong ones",
           &written<&damage>},
    Clause{"S7",
           "a point or viewpoint that is not finite is invalid_input; the region can still be put",
           &written<&not_finite>},
    Clause{"S8",
           "putting a region outside the index is not_found, putting one twice is already_exists",
           &written<&wrong_regions>},
    Clause{"S9", "a commit with a region missing is invalid_input and makes no bundle",
           &written<&missing_region>},
    Clause{"S10", "the index comes back exactly, with the points and viewpoints that were put",
           &written<&index_exact>},
    Clause{"S11", "regions without points, with one point and with equal points are kept",
           &written<&few_points>},
    Clause{"S12",
           "once another bundle is in the place of the one that was opened, reading gives the old "
           "one or an error",
           &written<&replaced>},
    Clause{"S13", "without a bundle, open is not_found", &no_bundle},
    Clause{"S14", "the same bundle has the same files byte for byte, whatever the place and order",
           &written<&same_bytes>},
    Clause{"S15", "viewpoints and prepared bytes come back, with and without points",
           &written<&viewpoints_and_prepared>},
    Clause{"S16", "views come back, the index has the largest; wrong ones are invalid_input",
           &written<&views>},
    Clause{"S17", "attached bytes come back unchanged, none and those of every value too",
           &written<&attached_bytes>},
    Clause{"S18", "every allowed name can be attached, or all are unsupported",
           &written<&attach_supported>},
    Clause{"S19", "a name that was not attached is not_found", &written<&not_attached>},
    Clause{"S20", "attaching a name twice is already_exists, and the first bytes stay",
           &written<&attached_twice>},
    Clause{"S21", "attach changes the bundle that was opened, and its regions stay",
           &written<&attached_later>},
    Clause{"S22", "a name but of 1 to 32 lower-case letters and underscores is invalid_input",
           &written<&attachment_names>},
    Clause{"S23", "attachments are there after the commit only; without one nothing is left",
           &written<&attachments_commit>},
    Clause{"S24", "with a damaged file an attachment is corrupt_data or right, never wrong",
           &written<&damaged_attachments>},
    Clause{"S25", "a directory says what the index says, and finds the regions that meet an area",
           &directory_agrees},
    Clause{"S26", "may_begin refuses only what begin refuses, and changes nothing",
           &written<&may_begin>},
    Clause{"S27",
           "a store that only reads says so: begin and attach are unsupported, and no file changes",
           &read_only_refuses},
    Clause{"S28", "1, 2 and 7 threads give the same files and the same data",
           &written<&any_threads>},
};

}  // namespace

template <>
std::span<const Clause> own_clauses<MapStore>() {
  return kClauses;
}

}  // namespace vantage::conformance
