#include "selection.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

namespace vantage::shared_tiles {
namespace {

std::vector<std::uint32_t> picks_of(const std::vector<Run>& runs) {
  std::vector<std::uint32_t> picks;
  for (const Run& run : runs) {
    for (std::uint32_t i = run.begin; i < run.end; ++i) picks.push_back(i);
  }
  return picks;
}

TEST_CASE("a selection comes back, whatever its coding") {
  std::mt19937 random(4);
  int seen[3] = {};
  for (int round = 0; round < 600; ++round) {
    CAPTURE(round);
    const auto points = static_cast<std::uint32_t>(1 + random() % 700);
    const auto changes = 1 + random() % (round % 2 == 0 ? 3 : 90);  // of 100
    std::vector<std::uint32_t> picks;
    bool taken = random() % 2 == 0;
    for (std::uint32_t i = 0; i < points; ++i) {
      if (random() % 100 < changes) taken = !taken;
      if (taken || round % 50 == 0) picks.push_back(i);
    }
    if (picks.empty()) continue;
    std::string bytes;
    const Coding coding = append_selection(bytes, picks, points);
    ++seen[static_cast<int>(coding)];
    CHECK(bytes.size() <= (points + 7) / 8);
    const auto count = static_cast<std::uint32_t>(picks.size());
    const auto runs = read_selection(bytes, coding, points, count);
    REQUIRE(runs);
    CHECK(picks_of(*runs) == picks);
    CHECK_FALSE(read_selection(bytes, coding, points, count + 1));
    CHECK_FALSE(read_selection(bytes, coding, points, count - 1));
  }
  CHECK(std::all_of(std::begin(seen), std::end(seen), [](int n) { return n > 5; }));
}

TEST_CASE("what is no code of a selection is refused") {
  const auto read = [](std::string_view bytes, std::uint32_t coding) {
    return read_selection(bytes, static_cast<Coding>(coding), 10, 3);
  };
  CHECK(read(std::string_view("\x07\0", 2), 1) == std::vector<Run>{{0, 3}});
  CHECK_FALSE(read("\x07", 1));  // too short
  CHECK_FALSE(read(std::string_view("\x07\0\0", 3), 1));
  CHECK_FALSE(read("\x03\x08", 1));  // a bit behind the last point
  CHECK(read("\x02\x03", 2) == std::vector<Run>{{2, 5}});
  CHECK_FALSE(read("\x08\x03", 2));  // beyond the last point
  CHECK_FALSE(read("\x02", 2));      // half a pair
  CHECK_FALSE(read("\x02\x83", 2));  // a number that is cut off
  CHECK_FALSE(read("\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01\x03", 2));
  CHECK_FALSE(read("", 0));          // all are ten, not three
  CHECK_FALSE(read("\x02\x03", 3));  // no such coding
}

}  // namespace
}  // namespace vantage::shared_tiles
