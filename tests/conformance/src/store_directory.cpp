// S25: MapReader::directory.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "clauses.hpp"
#include "store_bundles.hpp"
#include "vantage/region_directory.hpp"

namespace vantage::conformance {
namespace {

/// Overlapping regions of every shape; every fifth has no map.
Bundle overlapping_regions(const Subject& subject) {
  Random random(subject.seed());
  const auto place = [&] {
    return Eigen::Vector2d(random.uniform(-90, 90), random.uniform(-90, 90));
  };
  const auto box = [&](double width) {
    const Eigen::Vector2d min = place();
    return HalfOpenBox{min, min + Eigen::Vector2d(width, 0.5 * width)};
  };
  std::vector<Region> regions;
  Bundle bundle;
  for (int r = 0; r < 40; ++r) {
    Region region{"region_" + std::to_string(r), box(r % 4 == 0 ? 60.0 : 9.0), {}};
    if (r % 3 == 1) {
      const Eigen::Vector2d at = place();
      region.footprint =
          ConvexPolygon{{at, at + Eigen::Vector2d(20, 3), at + Eigen::Vector2d(4, 18)}};
    }
    if (r % 3 == 2) region.footprint = BoxUnion{{box(5.0), box(15.0)}};
    if (r % 2 == 0) region.height = {-2.0, 4.0};
    regions.push_back(std::move(region));
    RegionMap map;
    for (int k = 0; r % 5 != 0 && k <= r; ++k) map.points.emplace_back(0.5 * k, r, 1.0);
    bundle.maps.push_back(std::move(map));
  }
  bundle.index = index_of(std::move(regions));
  return bundle;
}

bool meet(const Bounds2& a, const Bounds2& b) {
  return (a.min.array() <= b.max.array()).all() && (b.min.array() <= a.max.array()).all();
}

template <class T>
T read(Result<T> result) {
  if (!result) FAIL("it is not read: " << to_string(result.error()));
  return *std::move(result);
}

void check_summary(const BundleSummary& said, const MapIndex& index) {
  CHECK(said.regions == index.regions.size());
  CHECK(said.map_points == index.map_points);
  CHECK(said.config == index.config);
  CHECK(same_bits(said.map_bounds.min, index.map_bounds.min));
  CHECK(same_bits(said.map_bounds.max, index.map_bounds.max));
  RegionSummary sum;
  std::uint64_t empty = 0, without_points = 0, most = 0, least = index.regions.front().points;
  Bounds2 extent;
  for (std::uint32_t r = 0; r < index.regions.size(); ++r) {
    const RegionSummary& region = index.regions[r];
    sum.points += region.points;
    sum.bytes += region.bytes;
    empty += region.empty() ? 1U : 0U;
    without_points += region.points == 0 ? 1U : 0U;
    most = std::max(most, region.points);
    least = std::min(least, region.points);
    const Bounds2 box = bounds_of(index.partition.regions()[r].footprint);
    extent.extend(box.min);
    extent.extend(box.max);
  }
  CHECK(said.sum.points == sum.points);
  CHECK(said.sum.bytes == sum.bytes);
  CHECK(said.empty_regions == empty);
  CHECK(said.without_points == without_points);
  CHECK(said.most_points == most);
  CHECK(said.least_points == least);
  CHECK(said.extent.min == extent.min);
  CHECK(said.extent.max == extent.max);
}

std::vector<RegionId> meeting_in(const MapIndex& index, const Bounds2& area) {
  std::vector<RegionId> meeting;
  for (std::uint32_t r = 0; r < index.regions.size(); ++r) {
    if (meet(bounds_of(index.partition.regions()[r].footprint), area)) {
      meeting.push_back(RegionId{r});
    }
  }
  return meeting;
}

}  // namespace

void check_directory_reads(const MapReader& reader, const MapIndex& index) {
  const auto opened = reader.directory();
  if (!opened) return;
  const RegionDirectory& directory = **opened;
  check_summary(directory.summary(), index);
  for (std::uint32_t r = 0; r < index.regions.size(); ++r) {
    CAPTURE(r);
    const Region& region = index.partition.regions()[r];
    if (const auto entry = directory.entry(RegionId{r})) {
      CHECK(entry->region == region);
      CHECK(entry->summary.points == index.regions[r].points);
      CHECK(entry->summary.bytes == index.regions[r].bytes);
    }
    if (const auto found = directory.find(region.label)) CHECK(*found == RegionId{r});
    const Bounds2 area = bounds_of(region.footprint);
    if (const auto meeting = directory.meeting(area)) CHECK(*meeting == meeting_in(index, area));
  }
  if (const auto found = directory.find("no such region")) CHECK(*found == std::nullopt);
}

void directory_agrees(const Subject& subject) {
  const Place place(subject);
  if (only_reads(subject)) {
    place_bundle(subject, place);
  } else {
    const Bundle bundle = overlapping_regions(subject);
    finish(place.begin(subject, bundle), bundle);
  }
  const Reader reader = place.open(subject);
  const MapIndex index = index_in(*reader);
  const auto opened = reader->directory();
  if (!opened) FAIL("the directory is not read: " << to_string(opened.error()));
  const RegionDirectory& directory = **opened;
  check_summary(directory.summary(), index);

  const auto count = static_cast<std::uint32_t>(index.regions.size());
  for (std::uint32_t r = 0; r < count; ++r) {
    CAPTURE(r);
    const auto entry = directory.entry(RegionId{r});
    REQUIRE(entry.has_value());
    CHECK(entry->region == index.partition.regions()[r]);
    CHECK(entry->summary.points == index.regions[r].points);
    CHECK(entry->summary.bytes == index.regions[r].bytes);
    CHECK(read(directory.find(entry->region.label)) == RegionId{r});
  }
  check_fails(directory.entry(RegionId{count}), ErrorCode::not_found);
  check_fails(directory.entry(RegionId{~0U}), ErrorCode::not_found);
  CHECK(read(directory.find("no such region")) == std::nullopt);

  Random random(subject.seed());
  for (int k = 0; k < 300; ++k) {
    const double reach = k % 10 == 0 ? 5000.0 : 110.0;
    const Eigen::Vector2d xy(random.uniform(-reach, reach), random.uniform(-reach, reach));
    CAPTURE(xy.transpose());
    const double half = random.uniform(0, 40);
    const Bounds2 area{xy.array() - half, xy.array() + half};
    CHECK(read(directory.meeting(area)) == meeting_in(index, area));
  }
}

}  // namespace vantage::conformance
