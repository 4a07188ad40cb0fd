#include "vantage/engine/region_maps.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <mutex>
#include <random>
#include <set>
#include <thread>

#include "support/fakes.hpp"

using namespace vantage;

namespace {

constexpr std::size_t kRegionBytes = 1000;

/// What the fakes below have seen; the test sets what they do.
struct Events {
  std::mutex mutex;
  std::vector<std::uint32_t> gets;
  std::set<std::uint32_t> broken;
  std::atomic<int> alive{0};
  std::atomic<std::size_t> grown_by{0};  // every target, since it was made [bytes]
  std::atomic<bool> gate_open{true};     // nothing is loaded while it is not

  [[nodiscard]] std::vector<std::uint32_t> loaded() {
    const std::scoped_lock lock(mutex);
    return gets;
  }
};

class CountingReader final : public MapReader {
 public:
  explicit CountingReader(Events& events) : events_(events) {}
  [[nodiscard]] Result<MapIndex> index() const noexcept override { return MapIndex{}; }
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept override {
    return fail(ErrorCode::unsupported, "is not asked for");
  }
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override {
    events_.gate_open.wait(false);
    const std::scoped_lock lock(events_.mutex);
    events_.gets.push_back(region.value);
    if (events_.broken.contains(region.value)) return fail(ErrorCode::corrupt_data, "damaged");
    return RegionMap{
        .points = PointCloud(region.value + 1, Point::Zero()), .viewpoints = {}, .prepared = {}};
  }

 private:
  Events& events_;
};

class ReportingMatcher final : public ScanMatcher {
 public:
  explicit ReportingMatcher(Events& events) : events_(events) {}
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept override {
    class Target final : public MatchTarget {
     public:
      Target(Events& events, std::size_t points) : events_(events), points_(points) {
        ++events_.alive;
      }
      ~Target() override { --events_.alive; }
      [[nodiscard]] Result<Alignment> align(PointsView, const Pose&) const noexcept override {
        return Alignment{};
      }
      [[nodiscard]] Result<ScanScore> score(PointsView, const Pose&) const noexcept override {
        return ScanScore{};
      }
      [[nodiscard]] std::size_t bytes() const noexcept override {
        return kRegionBytes + events_.grown_by;
      }
      [[nodiscard]] std::size_t elements() const noexcept override { return points_; }

     private:
      Events& events_;
      std::size_t points_;
    };
    return std::make_unique<Target>(events_, map.size());
  }

 private:
  Events& events_;
};

struct Fixture {
  Events events;
  CountingReader bundle{events};
  PluginPtr<ScanMatcher> matcher = test::in_process<ReportingMatcher, ScanMatcher>(events);
};

std::vector<RegionId> ids(std::initializer_list<std::uint32_t> values) {
  std::vector<RegionId> regions;
  for (const std::uint32_t r : values) regions.push_back(RegionId{r});
  return regions;
}

}  // namespace

TEST_CASE("what was expected is taken without blocking, what was not is loaded by the taker") {
  Fixture f;
  RegionMaps maps(f.bundle, f.matcher, {});
  maps.expect(ids({3, 1}));
  maps.wait_until_idle();
  CHECK(f.events.loaded() == std::vector<std::uint32_t>{3, 1});
  const auto expected = maps.take(RegionId{3});
  REQUIRE(expected);
  CHECK_FALSE(expected->blocked);
  CHECK(expected->region->map_points == 4);
  const auto surprise = maps.take(RegionId{7});
  REQUIRE(surprise);
  CHECK(surprise->blocked);
  CHECK(surprise->region->map_points == 8);
  CHECK_FALSE(maps.take(RegionId{7})->blocked);
  CHECK(maps.statistics().loaded_in_background == 2);
  CHECK(maps.statistics().loaded_by_taker == 1);
  CHECK(maps.statistics().bytes == 3 * kRegionBytes);
}

TEST_CASE("without a background everything is loaded by the taker, once") {
  Fixture f;
  RegionMaps maps(f.bundle, f.matcher, {.background = false});
  maps.expect(ids({3, 1}));
  maps.wait_until_idle();
  CHECK(f.events.loaded().empty());
  CHECK(maps.take(RegionId{3})->blocked);
  CHECK_FALSE(maps.take(RegionId{3})->blocked);
  CHECK(f.events.loaded().size() == 1);
}

TEST_CASE("a region that is being loaded is waited for, not loaded twice") {
  Fixture f;
  RegionMaps maps(f.bundle, f.matcher, {});
  f.events.gate_open = false;
  maps.expect(ids({5}));
  std::thread opener([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    f.events.gate_open = true;
    f.events.gate_open.notify_all();
  });
  // Whether the loader or the taker comes first: one of them loads, once.
  const auto taken = maps.take(RegionId{5});
  opener.join();
  REQUIRE(taken);
  CHECK(taken->blocked);
  CHECK(f.events.loaded() == std::vector<std::uint32_t>{5});
}

TEST_CASE("memory is bounded: what was used longest ago goes, what is expected stays") {
  Fixture f;
  {
    RegionMaps maps(f.bundle, f.matcher, {.memory = 4 * kRegionBytes});
    for (const std::uint32_t r : {0U, 1U, 2U, 0U, 3U}) REQUIRE(maps.take(RegionId{r}));
    CHECK(maps.statistics().bytes == 3 * kRegionBytes);  // one more was on its way
    CHECK_FALSE(maps.take(RegionId{0})->blocked);        // used again before 3 came
    CHECK_FALSE(maps.take(RegionId{2})->blocked);
    CHECK_FALSE(maps.take(RegionId{3})->blocked);
    CHECK(f.events.alive == 3);

    // 3 is taken; the three that come first fit beside it.
    maps.expect(ids({10, 11, 12, 13}));
    maps.wait_until_idle();
    CHECK(f.events.alive == 4);
    CHECK_FALSE(maps.take(RegionId{10})->blocked);
    CHECK_FALSE(maps.take(RegionId{11})->blocked);
    const std::size_t loads = f.events.loaded().size();
    maps.expect(ids({10, 11, 12, 13}));  // the same again: nothing is tried in vain
    maps.wait_until_idle();
    CHECK(f.events.loaded().size() == loads);
  }
  CHECK(f.events.alive == 0);
}

TEST_CASE("memory that targets take while they are used counts, and is given back at a take") {
  Fixture f;
  RegionMaps maps(f.bundle, f.matcher, {.memory = 4 * kRegionBytes});
  for (const std::uint32_t r : {0U, 1U, 2U}) REQUIRE(maps.take(RegionId{r}));
  f.events.grown_by = kRegionBytes / 2;
  CHECK(maps.statistics().bytes == 3 * (kRegionBytes + kRegionBytes / 2));
  CHECK_FALSE(maps.take(RegionId{1})->blocked);
  CHECK(f.events.alive == 2);  // 0 went
  CHECK(maps.statistics().bytes == 2 * (kRegionBytes + kRegionBytes / 2));
  CHECK_FALSE(maps.take(RegionId{2})->blocked);
  CHECK(maps.take(RegionId{0})->blocked);
}

TEST_CASE("what is borrowed, and points on their way, count as well as what is kept") {
  Fixture f;
  RegionMaps maps(f.bundle, f.matcher, {.memory = 6 * kRegionBytes, .background = false});
  for (const std::uint32_t r : {0U, 1U, 2U, 3U}) REQUIRE(maps.take(RegionId{r}));
  CHECK(maps.statistics().bytes == 4 * kRegionBytes);
  {
    std::vector<std::shared_ptr<const ReadyRegion>> rivals;
    for (const std::uint32_t r : {10U, 11U, 12U}) {
      rivals.push_back(maps.borrow(RegionId{r}).value());
      CHECK(maps.statistics().bytes <= 6 * kRegionBytes);  // what is kept makes room
    }
    CHECK_FALSE(maps.take(RegionId{3})->blocked);
    CHECK(maps.statistics().regions == 2);
    CHECK(maps.statistics().bytes == 5 * kRegionBytes);
  }
  CHECK(maps.statistics().bytes == 2 * kRegionBytes);
  // A region whose points take three times the memory of its map: room is made for the next one.
  constexpr std::uint32_t kMany = 3 * kRegionBytes / sizeof(Point);
  REQUIRE(maps.take(RegionId{kMany}));
  REQUIRE(maps.take(RegionId{4}));
  CHECK(maps.statistics().regions <= 3);
  CHECK_FALSE(maps.take(RegionId{kMany})->blocked);
}

TEST_CASE("what was set aside leaves less for maps") {
  Fixture f;
  RegionMaps maps(f.bundle, f.matcher, {.memory = 6 * kRegionBytes, .background = false});
  for (const std::uint32_t r : {0U, 1U, 2U, 3U}) REQUIRE(maps.take(RegionId{r}));
  maps.set_aside(3 * kRegionBytes);
  CHECK_FALSE(maps.take(RegionId{3})->blocked);
  CHECK(maps.statistics().bytes == 3 * kRegionBytes);
}

TEST_CASE("a region that did not fit is loaded once it is needed sooner") {
  Fixture f;
  RegionMaps maps(f.bundle, f.matcher, {.memory = 4 * kRegionBytes});
  for (std::uint32_t k = 0; k < 12; ++k) {
    const auto taken = maps.take(RegionId{k});
    REQUIRE(taken);
    CAPTURE(k);
    CHECK(taken->blocked == (k == 0));
    maps.expect(ids({k + 1, k + 2, k + 3, k + 4}));  // the last one does not fit
    maps.wait_until_idle();
  }
}

TEST_CASE("a map that is dropped while it is borrowed counts, and is borrowed again unread") {
  Fixture f;
  RegionMaps maps(f.bundle, f.matcher, {.memory = kRegionBytes, .background = false});
  REQUIRE(maps.take(RegionId{1}));
  const auto borrowed = maps.borrow(RegionId{1}).value();
  REQUIRE(maps.take(RegionId{2}));
  CHECK(maps.statistics().regions == 1);
  CHECK(maps.statistics().bytes == 2 * kRegionBytes);
  CHECK(maps.borrow(RegionId{1}).value() == borrowed);
  CHECK(f.events.loaded() == std::vector<std::uint32_t>{1, 2});
}

TEST_CASE("a region larger than the memory is kept while it is the last one taken") {
  Fixture f;
  RegionMaps maps(f.bundle, f.matcher, {.memory = 10});
  const auto first = maps.take(RegionId{1});
  REQUIRE(first);
  CHECK_FALSE(maps.take(RegionId{1})->blocked);
  REQUIRE(maps.take(RegionId{2}));
  CHECK(maps.statistics().regions == 1);
  CHECK(first->region->map_points == 2);  // the taker's copy lives on
  CHECK(f.events.alive == 2);
}

TEST_CASE("a failure in the background shows when the region is taken, and passes") {
  Fixture f;
  f.events.broken = {4};
  RegionMaps maps(f.bundle, f.matcher, {});
  maps.expect(ids({4, 5}));
  maps.wait_until_idle();
  CHECK(f.events.loaded() == std::vector<std::uint32_t>{4, 5});
  const auto broken = maps.take(RegionId{4});
  REQUIRE_FALSE(broken);
  CHECK(broken.error().code == ErrorCode::corrupt_data);
  CHECK_FALSE(maps.take(RegionId{5})->blocked);
  {
    const std::scoped_lock lock(f.events.mutex);
    f.events.broken.clear();
  }
  CHECK(maps.take(RegionId{4}));
}

TEST_CASE("10,000 random switches, expectations that come true and that do not, two takers") {
  Fixture f;
  constexpr std::uint32_t kRegions = 64;
  RegionMaps maps(f.bundle, f.matcher, {.memory = 8 * kRegionBytes});
  const auto drive = [&](unsigned seed) {
    std::mt19937 random(seed);
    std::uint32_t at = random() % kRegions;
    for (int i = 0; i < 5000; ++i) {
      const std::uint32_t next = random() % kRegions, other = random() % kRegions;
      maps.expect(ids({random() % 4 == 0 ? other : next, (next + 1) % kRegions}));
      if (random() % 8 == 0) std::this_thread::yield();
      at = random() % 3 == 0 ? other : next;
      const auto taken = maps.take(RegionId{at});
      if (!taken || taken->region->map_points != at + 1) return false;
    }
    return true;
  };
  std::atomic<bool> second = false;
  std::thread thread([&] { second = drive(2); });
  CHECK(drive(1));
  thread.join();
  CHECK(second);
  maps.wait_until_idle();
  CHECK(maps.statistics().bytes <= 8 * kRegionBytes);
  CHECK(f.events.alive == static_cast<int>(maps.statistics().regions));
}

TEST_CASE("a region that stores no map has nothing to match, as one whose map is too sparse") {
  const Fixture f;
  const auto memory = std::make_shared<test::Memory>();
  memory->maps[0] = {.points = {}, .viewpoints = {{1.0, 2.0, 3.0}}, .prepared = {}};
  const test::MemoryReader bundle(memory);
  const auto ready = make_ready(bundle, f.matcher, RegionId{0});
  REQUIRE_FALSE(ready);
  CHECK(ready.error().code == ErrorCode::too_few_matches);
}
