// What a run is fed with.
#include <doctest/doctest.h>

#include <fstream>

#include "support/bags/cloud_bags.hpp"
#include "support/real_data.hpp"
#include "terminal/input_options.hpp"
#include "unit/core/fakes.hpp"

using namespace vantage;

namespace {

std::vector<test::FloatScan> three_scans() {
  std::vector<test::FloatScan> scans;
  for (const std::int64_t second : {1, 2, 3}) {
    scans.push_back({second * 1'000'000'000, {{1.0F, 2.0F, 3.0F}, {4.0F, 5.0F, 6.0F}}});
  }
  return scans;
}

/// Of a map with one region, in which every scan is where it was thought to be.
Localizer localizer() {
  auto memory = std::make_shared<test::Memory>();
  const auto partition = Partition::from({Region{"all", HalfOpenBox{{-50, -50}, {50, 50}}, {}}});
  REQUIRE(partition);
  memory->index.partition = *partition;
  memory->maps[0] = {.points = {{0.0, 0.0, 0.0}}, .viewpoints = {}, .prepared = {}};
  REQUIRE(test::MemoryStore(memory).commit());
  auto opened = Localizer::open(
      Bundle::of(test::in_process<test::MemoryStore, MapStore>(memory), "memory").value(),
      test::in_process<test::TruthMatcher, ScanMatcher>(std::make_shared<test::Truth>()), {});
  REQUIRE_MESSAGE(opened, to_string(opened.error()));
  return *std::move(opened);
}

Result<Run> run(const RunInputs& inputs) { return localize_scans(localizer(), "c.toml", inputs); }

}  // namespace

TEST_CASE("a recording is opened once: the run reads what was opened to look at it") {
  for (const test::CloudBag& bag : test::cloud_bags()) {
    CAPTURE(bag.name);
    const test::TemporaryFolder folder;
    const auto path = folder.path() / "scans";
    std::ofstream(path, std::ios::binary) << bag.write(three_scans(), test::PointLayout::packed);
    auto inputs = InputOptions{.scans = path}.open();
    REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
    inputs->initial_pose = Pose{};
    std::filesystem::remove(path);  // an open file can still be read
    const auto first = run(*inputs);
    REQUIRE_MESSAGE(first, to_string(first.error()));
    CHECK(first->scans.size() == 3);
    const auto second = run(*inputs);  // only the first run gets what was open
    REQUIRE_FALSE(second);
    CHECK(second.error().code == ErrorCode::not_found);
  }
}

TEST_CASE("every run reads the recording from its beginning") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "scans";
  std::ofstream(path, std::ios::binary)
      << test::cloud_bags().front().write(three_scans(), test::PointLayout::packed);
  auto inputs = InputOptions{.scans = path}.open();
  REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
  inputs->initial_pose = Pose{};
  for (int i = 0; i < 3; ++i) {
    const auto done = run(*inputs);
    REQUIRE_MESSAGE(done, to_string(done.error()));
    REQUIRE(done->scans.size() == 3);
    CHECK(done->scans.front().report.stamp == 1.0);
  }
}
