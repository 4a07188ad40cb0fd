#include "store_bundles.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

#include "clauses.hpp"

namespace vantage::conformance {

namespace fs = std::filesystem;

PluginPtr<MapStore> Place::store(const Subject& subject) const {
  auto store = subject.create<MapStore>(params_);
  if (!store) FAIL("cannot make the plugin: " << to_string(store.error()));
  return *std::move(store);
}

Reader Place::open(const Subject& subject) const {
  const auto store = this->store(subject);
  auto reader = store->open();
  if (!reader) FAIL("the bundle cannot be opened: " << to_string(reader.error()));
  if (!*reader) FAIL("open gave no reader and no error");
  return in_library_of(store, *std::move(reader));
}

Writer Place::begin(const Subject& subject, const Bundle& bundle) const {
  const auto store = this->store(subject);
  auto writer = store->begin(bundle.index);
  if (!writer) FAIL("the bundle cannot be begun: " << to_string(writer.error()));
  if (!*writer) FAIL("begin gave no writer and no error");
  return in_library_of(store, *std::move(writer));
}

MapIndex index_of(std::vector<Region> regions) {
  auto partition = Partition::from(std::move(regions));
  if (!partition) FAIL("the suite's own partition: " << to_string(partition.error()));
  MapIndex index;
  index.partition = *std::move(partition);
  index.map_bounds = {{0, 0, 0}, {30, 10, 5}};
  index.map_points = 1000;
  index.config = "schema = 1\n";
  return index;
}

PreparedMap some_prepared(Random& random, std::size_t bytes, std::uint64_t elements) {
  PreparedMap prepared{.bytes = {}, .elements = elements};
  for (std::size_t i = 0; i < bytes; ++i) {
    prepared.bytes.push_back(static_cast<std::byte>(random.below(256)));
  }
  return prepared;
}

std::vector<std::uint32_t> some_views(Random& random, std::size_t points, std::uint32_t most) {
  std::vector<std::uint32_t> views(points, most);
  for (std::size_t i = 1; i < points; ++i) {
    views[i] = 1 + static_cast<std::uint32_t>(random.below(most));
  }
  return views;
}

Bundle some_bundle(const Subject& subject) {
  Random random(subject.seed());
  Bundle bundle;
  std::vector<Region> regions;
  for (std::uint32_t r = 0; r < 3; ++r) {
    const double x = 10.0 * r;
    regions.push_back({"region_" + std::to_string(r), HalfOpenBox{{x, 0}, {x + 10, 10}}, {}});
    PointCloud points = random_cloud(random, 40 + random.below(20), {x, 0, 0}, {x + 10, 10, 5});
    bundle.maps.push_back({std::move(points),
                           random_cloud(random, 5 + r, {x, 0, 1}, {x + 10, 9, 2}),
                           some_prepared(random, 31 * r, 4 * r)});
    if (r == 1) bundle.maps[r].views = some_views(random, bundle.maps[r].points.size(), 5 + r);
  }
  bundle.index = index_of(std::move(regions));
  return bundle;
}

void require(const Result<void>& done, const char* what) {
  if (!done) FAIL(what << ": " << to_string(done.error()));
}

void put_all(MapWriter& writer, const Bundle& bundle) {
  for (std::uint32_t r = 0; r < bundle.maps.size(); ++r) {
    require(writer.put(RegionId{r}, bundle.maps[r]), "put");
  }
}

void commit(Writer writer) { require(std::move(*writer).commit(), "commit"); }

void finish(Writer writer, const Bundle& bundle) {
  put_all(*writer, bundle);
  commit(std::move(writer));
}

void check_refused(Writer writer, ErrorCode code) {
  check_fails(std::move(*writer).commit(), code);
}

bool only_reads(const Subject& subject) {
  const Place place(subject);
  const auto may = place.store(subject)->may_begin();
  return !may && may.error().code == ErrorCode::unsupported;
}

void place_bundle(const Subject& subject, const Place& place) {
  if (!only_reads(subject)) {
    const Bundle bundle = some_bundle(subject);
    finish(place.begin(subject, bundle), bundle);
    return;
  }
  const fs::path bundle = subject.claims<StoreClaims>().bundle;
  if (bundle.empty()) does_not_apply("the store only reads, and claims no bundle");
  fs::copy(bundle, place.folder(), fs::copy_options::recursive);
}

MapIndex index_in(const MapReader& reader) {
  auto index = reader.index();
  if (!index) FAIL("the index is not read: " << to_string(index.error()));
  return *std::move(index);
}

RegionMap get(const MapReader& reader, std::uint32_t region) {
  auto map = reader.get(RegionId{region});
  if (!map) FAIL("region " << region << " is not read: " << to_string(map.error()));
  return *std::move(map);
}

bool same_bits(const Point& a, const Point& b) {
  return std::memcmp(a.data(), b.data(), sizeof(double) * 3) == 0;
}

bool same(const RegionMap& a, const RegionMap& b) {
  return a.viewpoints == b.viewpoints && a.points == b.points && a.prepared == b.prepared &&
         a.views == b.views;
}

bool same(const MapIndex& a, const MapIndex& b) {
  return a.partition.regions() == b.partition.regions() && a.map_points == b.map_points &&
         same_bits(a.map_bounds.min, b.map_bounds.min) &&
         same_bits(a.map_bounds.max, b.map_bounds.max) && a.config == b.config &&
         std::equal(a.regions.begin(), a.regions.end(), b.regions.begin(), b.regions.end(),
                    [](const RegionSummary& x, const RegionSummary& y) {
                      return x.points == y.points && x.viewpoints == y.viewpoints &&
                             x.elements == y.elements && x.bytes == y.bytes &&
                             x.max_views == y.max_views;
                    });
}

void check_points_kept(const PointCloud& put, const PointCloud& got, double precision) {
  REQUIRE(got.size() == put.size());
  double worst = 0.0;
  for (std::size_t i = 0; i < put.size(); ++i) {
    // Not std::max, which would overlook a NaN.
    const double error = (put[i] - got[i]).cwiseAbs().maxCoeff();
    if (!(error <= worst)) worst = error;
  }
  CHECK_MESSAGE(worst <= precision,
                "a coordinate is off by " << worst << " m, claimed is " << precision << " m");
}

void check_kept(const Bundle& bundle, const MapReader& reader, double precision) {
  CHECK(index_in(reader).partition.size() == bundle.maps.size());
  for (std::uint32_t r = 0; r < bundle.maps.size(); ++r) {
    CAPTURE(r);
    const RegionMap got = get(reader, r);
    check_points_kept(bundle.maps[r].points, got.points, precision);
    check_points_kept(bundle.maps[r].viewpoints, got.viewpoints, precision);
  }
}

void check_kept(const Subject& subject, const Bundle& bundle, const MapReader& reader) {
  check_kept(bundle, reader, std::max(0.01, subject.claims<StoreClaims>().precision));
}

std::map<fs::path, std::string> files_below(const fs::path& folder) {
  std::map<fs::path, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    files[fs::relative(entry.path(), folder)] = {std::istreambuf_iterator<char>(in), {}};
  }
  return files;
}

void write_file(const fs::path& path, const std::string& content) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << content;
  out.close();
  if (!out) FAIL("cannot write " << path);
}

std::vector<Damaged> damages(Random& random, const std::string& good) {
  std::vector<Damaged> all{{"empty", ""}, {"a zero byte longer", good + '\0'}};
  if (good.empty()) return all;
  const auto cut = [&](std::size_t n) {
    all.push_back({"cut to " + std::to_string(n) + " bytes", good.substr(0, n)});
  };
  for (const std::size_t n : {good.size() - 1, good.size() / 2, std::size_t{1}}) cut(n);
  for (int i = 0; i < 5; ++i) cut(random.below(good.size()));
  for (int i = 0; i < 100; ++i) {
    const std::size_t byte = random.below(good.size()), bit = random.below(8);
    std::string bad = good;
    bad[byte] = static_cast<char>(bad[byte] ^ (1 << bit));
    all.push_back({"bit " + std::to_string(bit) + " of byte " + std::to_string(byte) + " flipped",
                   std::move(bad)});
  }
  return all;
}

}  // namespace vantage::conformance
