// The files of a build in parts, and how regions are divided into blocks.
#include "build/parts.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <functional>
#include <random>

#include "build/blocks.hpp"
#include "build/build_identity.hpp"
#include "build/plan_file.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/map_parts.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kKey = 0x1234'5678'9abc'def0;
const BuildIdentity kIdentity{{{"map", 17}, {"configuration", kKey}}};
constexpr Shard kShard{1, 2};

BuildPlan some_plan() {
  BuildPlan plan;
  plan.partition =
      Partition::from(
          {{"box", HalfOpenBox{{0.0, 0.0}, {10.0, 5.0}}, {}},
           {"polygon", ConvexPolygon{{{20.0, 0.0}, {30.0, 0.0}, {25.0, 9.0}}}, {-1.0, 4.0}},
           {"union", BoxUnion{{{{40.0, 0.0}, {41.0, 1.0}}, {{41.0, 0.0}, {45.0, 3.0}}}}, {}}})
          .value();
  plan.viewpoints = {{{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}}, {}, {{42.0, 1.0, 1.7}}};
  plan.owned = {100, 7, 12};
  plan.limits = {.map_bounds = {{0.0, 0.0, -1.0}, {45.0, 9.0, 4.0}}, .max_range = 60.0};
  plan.map_points = 119;
  plan.ground_points = 80;
  plan.unreachable_voxels = 3;
  plan.places_outside = 2;
  plan.place_index = {std::byte{0}, std::byte{7}, std::byte{255}};
  return plan;
}

TEST_CASE("a recording for [selector] is known by what is in it, not by its path") {
  const test::TemporaryFolder folder;
  const auto identity = [&](const std::string& scans, const std::string& poses) {
    BuildParams params;
    params.effective_config = "schema = 1\n[map]\ntrajectory = \"" +
                              (folder.path() / "driven.tum").string() +
                              "\"\n[selector]\nplugin = \"contribution\"\nscans = \"" +
                              (folder.path() / scans).string() + "\"\n";
    if (!poses.empty()) {
      params.effective_config += "poses = \"" + (folder.path() / poses).string() + "\"\n";
    }
    const auto known = identity_of(1, {}, BuildPlugins(), params);
    REQUIRE_MESSAGE(known, to_string(known.error()));
    return known->key();
  };
  fs::create_directories(folder.path() / "scans" / "more");
  test::write_text(folder.path() / "scans" / "1.pcd", "one");
  test::write_text(folder.path() / "scans" / "more" / "2.pcd", "two");
  test::write_text(folder.path() / "driven.tum", "0 0 0 0 0 0 0 1\n");
  test::write_text(folder.path() / "poses.tum", "0 0 0 0 0 0 0 1\n");
  const std::uint64_t first = identity("scans", "");
  CHECK(identity("scans", "") == first);

  // Elsewhere, and by another path.
  fs::create_symlink("scans", folder.path() / "link");
  CHECK(identity("link", "poses.tum") == first);
  CHECK(identity("scans/../scans", "") == first);
  fs::rename(folder.path() / "scans", folder.path() / "moved");
  CHECK(identity("moved", "") == first);

  // Each of these is another recording. The folder's own time stays.
  const fs::path scan = folder.path() / "moved" / "more" / "2.pcd";
  const auto time = fs::last_write_time(scan);
  test::write_text(scan, "two, again");
  fs::last_write_time(scan, time);
  const std::uint64_t longer = identity("moved", "");
  CHECK(longer != first);
  fs::last_write_time(scan, time + std::chrono::seconds(2));
  CHECK(identity("moved", "") != longer);
  fs::last_write_time(scan, time);
  CHECK(identity("moved", "") == longer);
  fs::rename(scan, folder.path() / "moved" / "more" / "3.pcd");
  CHECK(identity("moved", "") != longer);
  fs::rename(folder.path() / "moved" / "more" / "3.pcd", scan);
  CHECK(identity("moved", "") == longer);
  test::write_text(folder.path() / "driven.tum", "0 0 0 0 0 0 1 0\n");
  CHECK(identity("moved", "") != longer);
  CHECK(identity("moved", "poses.tum") == longer);

  // A recording of one file.
  test::write_text(folder.path() / "a.bag", "bag");
  const std::uint64_t bag = identity("a.bag", "");
  fs::rename(folder.path() / "a.bag", folder.path() / "b.bag");
  CHECK(identity("b.bag", "") == bag);
  test::write_text(folder.path() / "b.bag", "longer");
  CHECK(identity("b.bag", "") != bag);
}

TEST_CASE("a plan comes back from its bytes, and from no others") {
  const BuildPlan plan = some_plan();
  const std::vector<std::byte> bytes = encode_plan(plan, kIdentity);
  const auto again = decode_plan(bytes, kIdentity);
  REQUIRE_MESSAGE(again, to_string(again.error()));
  CHECK(again->partition.regions() == plan.partition.regions());
  CHECK(again->viewpoints == plan.viewpoints);
  CHECK(again->owned == plan.owned);
  CHECK(again->limits.map_bounds.max == plan.limits.map_bounds.max);
  CHECK(again->limits.max_range == plan.limits.max_range);
  CHECK(again->places_outside == 2);
  CHECK(again->place_index == plan.place_index);
  CHECK(encode_plan(*again, kIdentity) == bytes);
  const BuildIdentity other{{{"map", 18}, {"configuration", kKey}}};
  CHECK(other.key() != kIdentity.key());
  const Error refused = decode_plan(bytes, other).error();
  CHECK(refused.code == ErrorCode::already_exists);
  CHECK(refused.message.find("another build, with another map:") != std::string::npos);

  for (std::size_t k = 0; k < bytes.size(); ++k) {
    std::vector<std::byte> damaged = bytes;
    damaged[k] ^= std::byte{0x10};
    CHECK_FALSE(decode_plan(damaged, kIdentity).has_value());
    CHECK_FALSE(decode_plan(std::span(bytes).first(k), kIdentity).has_value());
  }
}

TEST_CASE("a forged plan with a sound checksum is an error or a plan, never a crash") {
  const std::vector<std::byte> bytes = encode_plan(some_plan(), kIdentity);
  std::mt19937 random(3);
  for (int round = 0; round < 3000; ++round) {
    std::vector<std::byte> forged(bytes.begin(), bytes.end() - 8);
    for (int changes = 1 + static_cast<int>(random() % 3); changes > 0; --changes) {
      forged[16 + random() % (forged.size() - 16)] = static_cast<std::byte>(random());
    }
    if (round % 5 == 0) forged.resize(16 + random() % (forged.size() - 16));
    for (std::uint64_t value = checksum_of(std::span<const std::byte>(forged)), k = 0; k < 8;
         ++k, value >>= 8U) {
      forged.push_back(static_cast<std::byte>(value & 0xffU));
    }
    const auto decoded = decode_plan(forged, kIdentity);
    if (!decoded) CHECK_FALSE(decoded.error().message.empty());
  }
}

TEST_CASE("ranks name the same points in every part of a map that has them") {
  // Runs of 5, 1 and 4 points, with gaps.
  const MapPart part{PointCloud(10, Point::Zero()), {{100, 0}, {200, 5}, {300, 6}}};
  const IndexList points{0, 4, 5, 6, 9};
  const std::vector<std::uint64_t> ranks = ranks_of(part, points);
  CHECK(ranks == std::vector<std::uint64_t>{100, 104, 200, 300, 303});
  CHECK(indices_of(part, ranks).value() == points);
  const MapPart larger{PointCloud(210, Point::Zero()), {{99, 0}, {298, 199}}};
  CHECK(indices_of(larger, ranks).value() == IndexList{1, 5, 101, 201, 204});
  for (const std::uint64_t absent : {99, 105, 199, 201, 304}) {
    CAPTURE(absent);
    CHECK(indices_of(part, {absent}).error().code == ErrorCode::internal);
  }
  CHECK(indices_of({}, {5}).error().code == ErrorCode::internal);
  CHECK(indices_of({}, {}).value().empty());
}

StoredPart some_part(std::uint32_t seed) {
  std::mt19937_64 random(seed);
  StoredPart part;
  BuiltRegion& region = part.region;
  region.seen = 500;
  region.skipped = seed;
  region.points = 40;
  for (std::uint64_t rank = 0; part.ranks.size() < 40;) {
    part.ranks.push_back(rank += 1 + random() % 5);
    region.stored.views.push_back(1 + static_cast<std::uint32_t>(random() % 300));
  }
  part.ranks.push_back(std::uint64_t{1} << 40U);  // more than 32 bits
  region.stored.views.push_back(1);
  region.prepared = {.bytes = {std::byte{7}, static_cast<std::byte>(seed)}, .elements = 3};
  region.errors = {{{1.0, 2.0, static_cast<double>(seed)}, 0.02F, 0.01F}};
  return part;
}

TEST_CASE("finished regions come back from their files, and what is cut off is built again") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "shard_1_of_2.parts";
  {
    auto writer = PartWriter::create(folder.path(), kShard, kKey);
    REQUIRE(writer);
    CHECK(PartWriter::create(folder.path(), kShard, kKey).error().code ==
          ErrorCode::already_exists);  // it is locked
    REQUIRE(writer->add(4, some_part(4)));
    REQUIRE(writer->add(1, some_part(1)));
    REQUIRE(std::move(*writer).finish());
  }
  const std::string whole = test::read_text(file);
  const auto parts = Parts::in(folder.path(), kKey, 5);
  REQUIRE(parts);
  CHECK(parts->missing() == 3);
  for (const std::uint32_t r : {1U, 4U}) {
    REQUIRE(parts->has(r));
    const StoredPart wanted = some_part(r), part = parts->read(r).value();
    CHECK(part.ranks == wanted.ranks);
    CHECK(part.region.stored.views == wanted.region.stored.views);
    CHECK(part.region.prepared == wanted.region.prepared);
    CHECK(part.region.errors == wanted.region.errors);
    CHECK(part.region.skipped == wanted.region.skipped);
    CHECK(part.region.points == 40);
  }
  CHECK(Parts::in(folder.path(), kKey + 1, 5).error().code == ErrorCode::already_exists);

  // Cut anywhere, the regions before the cut are there, and another file has those after it.
  const fs::path next = folder.path() / "shard_1_of_2-2.parts";
  for (std::size_t size = 0; size < whole.size(); ++size) {
    test::write_text(file, whole.substr(0, size));
    const auto cut = Parts::in(folder.path(), kKey, 5);
    REQUIRE(cut);
    CHECK_FALSE(cut->has(1));
    if (size % 7 != 0) continue;
    {
      auto writer = PartWriter::create(folder.path(), kShard, kKey);
      REQUIRE(writer);
      if (!cut->has(4)) REQUIRE(writer->add(4, some_part(4)));
      REQUIRE(writer->add(1, some_part(1)));
      REQUIRE(std::move(*writer).finish());
    }
    CHECK(test::read_text(file) == whole.substr(0, size));
    const auto both = Parts::in(folder.path(), kKey, 5);
    REQUIRE(both);
    CHECK(both->missing() == 3);
    CHECK(both->read(1)->ranks == some_part(1).ranks);
    CHECK(both->read(4)->ranks == some_part(4).ranks);
    CHECK(both->files().size() == 2);
    fs::remove(next);
  }
  // What is no file of parts does not count, and is not listed. A file without a region goes.
  test::write_text(file, "mine");
  test::write_text(folder.path() / "mine.parts", "mine");
  CHECK(Parts::in(folder.path(), kKey, 5)->files().empty());
  CHECK(PartWriter::create(folder.path(), kShard, kKey).has_value());
  CHECK_FALSE(fs::exists(next));
  CHECK(test::read_text(file) == "mine");

  // A head that was not written: the content after it does not count.
  std::string torn = whole;
  const std::size_t second = whole.size() - (whole.size() - 16) / 2;
  std::fill_n(torn.begin() + static_cast<std::ptrdiff_t>(second) - 24, 48, '\0');
  test::write_text(file, torn);
  CHECK(Parts::in(folder.path(), kKey, 5));

  // A wrong byte is found when the region is read.
  for (std::size_t k = 16; k < whole.size(); ++k) {
    std::string damaged = whole;
    damaged[k] = static_cast<char>(damaged[k] ^ 4);
    test::write_text(file, damaged);
    const auto found = Parts::in(folder.path(), kKey, 5);
    if (!found) continue;
    for (const std::uint32_t r : {1U, 4U}) {
      if (!found->has(r)) continue;
      const auto part = found->read(r);
      if (part) CHECK(part->ranks == some_part(r).ranks);
    }
  }
}

TEST_CASE("a file of parts that is listed, and gone when it is opened, is no error") {
  const test::TemporaryFolder folder;
  {
    auto writer = PartWriter::create(folder.path(), kShard, kKey);
    REQUIRE(writer);
    REQUIRE(writer->add(4, some_part(4)));
    REQUIRE(std::move(*writer).finish());
  }
  // A name that leads nowhere, like that of a file which another process has just removed.
  for (const char* name : {"shard_0_of_9.parts", "shard_9_of_9.parts"}) {
    fs::create_symlink(folder.path() / "removed", folder.path() / name);
  }
  const auto parts = Parts::in(folder.path(), kKey, 5);
  REQUIRE_MESSAGE(parts, to_string(parts.error()));
  CHECK(parts->missing() == 4);
  CHECK(parts->files().size() == 1);
  CHECK(parts->read(4)->ranks == some_part(4).ranks);
}

/// Where the records of a file of parts begin.
std::vector<std::size_t> records_in(const std::string& file) {
  std::vector<std::size_t> begin;
  for (std::size_t at = 16; at < file.size();) {
    begin.push_back(at);
    std::uint64_t size = 0;
    std::memcpy(&size, file.data() + at + 8, sizeof size);
    at += 24 + size;
  }
  return begin;
}

TEST_CASE("regions whose numbers are swapped in a file of parts are damaged") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "shard_1_of_1.parts";
  {
    auto writer = PartWriter::create(folder.path(), {1, 1}, kKey);
    REQUIRE(writer);
    for (const std::uint32_t r : {0U, 1U, 2U}) REQUIRE(writer->add(r, some_part(r)));
    REQUIRE(std::move(*writer).finish());
  }
  std::string swapped = test::read_text(file);
  const auto records = records_in(swapped);
  REQUIRE(records.size() == 3);
  std::swap_ranges(swapped.begin() + static_cast<std::ptrdiff_t>(records[0]),
                   swapped.begin() + static_cast<std::ptrdiff_t>(records[0]) + 8,
                   swapped.begin() + static_cast<std::ptrdiff_t>(records[2]));
  test::write_text(file, swapped);
  const auto parts = Parts::in(folder.path(), kKey, 3);
  REQUIRE(parts);
  CHECK(parts->missing() == 0);
  CHECK(parts->read(1));
  for (const std::uint32_t r : {0U, 2U}) {
    const auto part = parts->read(r);
    REQUIRE_FALSE(part);
    CHECK(part.error().code == ErrorCode::corrupt_data);
    CHECK(to_string(part.error()).find("region " + std::to_string(r) + " is damaged") !=
          std::string::npos);
  }
}

/// What PartWriter puts before a content.
std::string sealed_record(std::uint64_t region, const std::string& content) {
  Checksum sum;
  sum.add(region);
  sum.add(std::uint64_t{content.size()});
  sum.add(content);
  std::string head;
  for (const std::uint64_t word : {region, std::uint64_t{content.size()}, sum.value()}) {
    head.append(reinterpret_cast<const char*>(&word), sizeof word);
  }
  return head + content;
}

TEST_CASE("a forged part with a sound checksum is an error or a part, never a crash") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "shard_1_of_1.parts";
  {
    auto writer = PartWriter::create(folder.path(), {1, 1}, kKey);
    REQUIRE(writer);
    REQUIRE(writer->add(0, some_part(3)));
    REQUIRE(std::move(*writer).finish());
  }
  const std::string whole = test::read_text(file);
  const std::string content = whole.substr(16 + 24);
  REQUIRE(whole == whole.substr(0, 16) + sealed_record(0, content));
  std::mt19937 random(8);
  int refused = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string forged = content;
    for (int changes = 1 + static_cast<int>(random() % 3); changes > 0; --changes) {
      forged[random() % forged.size()] = "\0\1\x7f\x80\xff"[random() % 5];
    }
    if (round % 5 == 0) forged.resize(1 + random() % forged.size());
    test::write_text(file, whole.substr(0, 16) + sealed_record(0, forged));
    const auto parts = Parts::in(folder.path(), kKey, 1);
    REQUIRE(parts);
    const auto part = parts->read(0);
    if (!part) {
      CHECK(part.error().code == ErrorCode::corrupt_data);
      ++refused;
      continue;
    }
    CHECK(std::ranges::is_sorted(part->ranks, std::less_equal<>()));
    const auto& views = part->region.stored.views;
    CHECK((views.empty() || views.size() == part->ranks.size()));
  }
  CHECK(refused > 500);
}

/// A map of which only the numbers of points are asked: one in each square metre.
class Counts final : public MapParts {
 public:
  [[nodiscard]] Bounds3 bounds() const noexcept override { return {}; }
  [[nodiscard]] std::uint64_t points() const noexcept override { return 0; }
  [[nodiscard]] Result<void> pass(MapVisitor&) const noexcept override { return {}; }
  [[nodiscard]] std::uint64_t points_in(const Bounds2& area) const override {
    const Eigen::Vector2d size = (area.max - area.min).cwiseMax(0.0);
    return static_cast<std::uint64_t>(size.x() * size.y());
  }
  [[nodiscard]] Result<MapPart> read(const Bounds2&) const override { return MapPart{}; }
};

TEST_CASE("blocks hold neighbours, fit into memory, and have every region once") {
  std::vector<Region> regions;
  std::vector<Bounds2> areas;
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 9; ++j) {
      const Eigen::Vector2d low(10.0 * i, 10.0 * j);
      regions.push_back({"r" + std::to_string(regions.size()),
                         HalfOpenBox{low, low + Eigen::Vector2d(10.0, 10.0)},
                         {}});
      areas.push_back(with_margin({low, low + Eigen::Vector2d(10.0, 10.0)}, 15.0));
    }
  }
  areas[5] = areas[60] = Bounds2{};  // need no points
  const Partition partition = Partition::from(regions).value();
  std::vector<std::uint32_t> some;
  for (std::uint32_t r = 0; r < regions.size(); r += r < 40 ? 1 : 2) some.push_back(r);
  const Counts map;
  const auto blocks = blocks_of(map, partition, some, areas, 40'000, 10);
  REQUIRE_MESSAGE(blocks, to_string(blocks.error()));
  std::vector<std::uint32_t> all;
  for (const RegionBlock& block : *blocks) {
    CHECK(std::ranges::is_sorted(block.regions));
    CHECK(map.points_in(block.area) <= 4'000);
    for (const std::uint32_t r : block.regions) {
      all.push_back(r);
      if (areas[r].min.x() > areas[r].max.x()) continue;
      CHECK(block.area.contains(areas[r].min));
      CHECK(block.area.contains(areas[r].max));
    }
  }
  std::ranges::sort(all);
  CHECK(all == some);
  CHECK(blocks->size() > 2);
  CHECK(blocks->size() < some.size() / 2);

  const auto too_large = blocks_of(map, partition, some, areas, 10'000, 10);
  REQUIRE_FALSE(too_large);
  CHECK(too_large.error().code == ErrorCode::invalid_input);
  CHECK(too_large.error().message.find("1600 points") != std::string::npos);
  CHECK(blocks_of(map, partition, {}, areas, 10, 10).value().empty());

  // The region that needs most is named, wherever it stands, and what it needs is enough for all.
  for (const std::uint32_t largest : {0U, 17U, 98U}) {
    auto uneven = areas;
    uneven[largest].max += Eigen::Vector2d(5.0, 5.0);
    const auto refused = blocks_of(map, partition, some, uneven, 10'000, 10);
    REQUIRE_FALSE(refused);
    const std::string& message = refused.error().message;
    CHECK_MESSAGE(message.find("'r" + std::to_string(largest) + "'") != std::string::npos, message);
    CHECK(message.find("2025 points") != std::string::npos);
    CHECK(blocks_of(map, partition, some, uneven, 20'250, 10));
    CHECK_FALSE(blocks_of(map, partition, some, uneven, 20'249, 10));
  }
}

TEST_CASE("a block has no more points than 32 bits can number, however much memory there is") {
  constexpr double kSide = 50'000.0;  // 2.5e9 points a region
  constexpr std::uint64_t kPlenty = std::uint64_t{1} << 60U;
  std::vector<Region> regions;
  std::vector<Bounds2> areas;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d low(kSide * i, 0.0), high = low + Eigen::Vector2d(kSide, kSide);
    regions.push_back({"r" + std::to_string(i), HalfOpenBox{low, high}, {}});
    areas.push_back({low, high});
  }
  const Partition partition = Partition::from(regions).value();
  const Counts map;
  const auto blocks = blocks_of(map, partition, std::vector{0U, 1U, 2U, 3U}, areas, kPlenty, 1);
  REQUIRE_MESSAGE(blocks, to_string(blocks.error()));
  CHECK(blocks->size() == 4);
  for (const RegionBlock& block : *blocks) CHECK(map.points_in(block.area) <= 0xffff'fffeU);

  areas[2] = with_margin(areas[2], 10'000.0);  // 4.9e9
  const auto too_many = blocks_of(map, partition, std::vector{0U, 2U}, areas, kPlenty, 1);
  REQUIRE_FALSE(too_many);
  CHECK(too_many.error().code == ErrorCode::invalid_input);
  CHECK(too_many.error().message ==
        "region 'r2' and what decides about it are 4900000000 points, but no more than 4294967294 "
        "can be worked on at once: make the regions or max_range smaller");
}

}  // namespace
}  // namespace vantage
