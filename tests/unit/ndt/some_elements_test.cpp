// Maps of which only some elements are kept.
#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "excerpt.hpp"
#include "objective.hpp"
#include "occupancy.hpp"
#include "pulls.hpp"
#include "scenes.hpp"
#include "support/plugins.hpp"

namespace vantage::some_elements {
namespace {

const Pose kTruth = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});

std::vector<std::uint64_t> keys_of(const ndt::VoxelMap& map) {
  return {map.keys().begin(), map.keys().end()};
}

/// One element in so many.
std::vector<std::uint32_t> one_in(std::size_t elements, std::uint32_t step) {
  std::vector<std::uint32_t> some;
  for (std::uint32_t i = 0; i < elements; i += step) some.push_back(i);
  return some;
}

std::vector<std::uint32_t> all_of(const MatchTarget& target) {
  return one_in(target.elements(), 1);
}

PluginPtr<MatchTarget> restored(std::span<const std::byte> bytes) {
  const auto matcher = test::plugin<ScanMatcher>("ndt", "");
  return in_library_of(matcher, matcher->restore(bytes).value());
}

}  // namespace

TEST_CASE("which voxels are occupied comes back, in less than four bits a voxel") {
  const auto map = ndt::VoxelMap::build(test::yard(51), {}).value();
  std::vector<std::uint64_t> keys = keys_of(map);
  const auto bytes = ndt::encode_occupancy(keys);
  CHECK(8.0 * static_cast<double>(bytes.size()) < 4.0 * static_cast<double>(keys.size()));
  CHECK(ndt::decode_occupancy(bytes, keys.size()) == keys);
  std::ranges::shuffle(keys, std::mt19937(4));
  CHECK(ndt::encode_occupancy(keys) == bytes);
  for (const std::size_t few : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
    std::vector<std::uint64_t> some(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(few));
    std::ranges::sort(some);
    CHECK(ndt::decode_occupancy(ndt::encode_occupancy(some), few) == some);
  }
}

TEST_CASE("other bytes than those of an occupancy are refused, or are one") {
  const auto keys = keys_of(ndt::VoxelMap::build(test::yard(51), {}).value());
  const auto bytes = ndt::encode_occupancy(keys);
  CHECK_FALSE(ndt::decode_occupancy(bytes, keys.size() - 1));
  CHECK_FALSE(ndt::decode_occupancy(bytes, keys.size() + 1));
  CHECK_FALSE(ndt::decode_occupancy({}, keys.size()));
  CHECK_FALSE(ndt::decode_occupancy(std::span(bytes).first(bytes.size() / 2), keys.size()));
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    auto damaged = bytes;
    damaged[random() % damaged.size()] ^= std::byte(1 + random() % 255);
    const auto decoded = ndt::decode_occupancy(damaged, keys.size());
    if (decoded) CHECK(std::ranges::adjacent_find(*decoded) == decoded->end());
  }
}

TEST_CASE("the pulls of all elements add up to the derivatives of the objective") {
  const PointCloud scan = test::seen_from(test::yard(52), kTruth, 18.0, 2000, 1);
  std::mt19937 random(1);
  const Pose pose = test::disturbed(kTruth, 0.1, 1.0, random);
  for (const ndt::Neighbours neighbours :
       {ndt::Neighbours::direct1, ndt::Neighbours::direct7, ndt::Neighbours::kdtree}) {
    const ndt::Objective objective(ndt::VoxelMap::build(test::yard(51), {}).value(), neighbours,
                                   matching::NdtCoefficients::derive(0.55, 1.0).value());
    ndt::Workspace workspace;
    objective.begin(scan, workspace);
    const ndt::Derivatives expected = objective.derivatives(objective.to_local(pose), workspace);
    ndt::Vector6 gradient = ndt::Vector6::Zero();
    ndt::Matrix6 hessian = ndt::Matrix6::Zero();
    const auto pulls = ndt::pulls_on(objective, scan, pose);
    REQUIRE(pulls.size() > 50);
    for (const Pull& pull : pulls) {
      for (Eigen::Index row = 0, k = 0; row < 6; ++row) {
        gradient[row] += static_cast<double>(pull.gradient[static_cast<std::size_t>(row)]);
        for (Eigen::Index column = row; column < 6; ++column, ++k) {
          hessian(row, column) += static_cast<double>(pull.hessian[static_cast<std::size_t>(k)]);
        }
      }
    }
    hessian.triangularView<Eigen::StrictlyLower>() = hessian.transpose();
    CHECK((gradient - expected.gradient).norm() < 1e-3 * expected.gradient.norm());
    CHECK((hessian - expected.hessian).norm() < 1e-3 * expected.hessian.norm());
  }
}

TEST_CASE("points on the faces of voxels pull the elements of the voxels that they lie in") {
  const auto map = ndt::VoxelMap::build(test::yard(51), {.resolution = 0.7}).value();
  const ndt::Objective objective(map, ndt::Neighbours::direct7,
                                 matching::NdtCoefficients::derive(0.55, 0.7).value());
  std::mt19937 random(3);
  const auto along = [&] { return 0.35 * (static_cast<int>(random() % 100) - 50); };
  PointCloud scan{{1e7, 0.0, 0.0}, {0.0, -1e12, 0.0}, {4e5, 4e5, 4e5}};
  for (int k = 0; k < 5000; ++k) scan.emplace_back(along(), along(), 0.1 * along());
  std::vector<std::uint32_t> expected, elements;
  for (const Point& p : scan) {
    for (std::uint32_t s = 0; s < objective.search().size; ++s) {
      const auto& step = objective.search().steps[s];
      const Point at = p + 0.7 * Point(step[0], step[1], step[2]);
      const auto key = map.key_of(at);
      if (key != ndt::kNoVoxel && map.find(key) != ndt::kNoGaussian) {
        expected.push_back(map.find(key));
      }
    }
  }
  std::ranges::sort(expected);
  expected.erase(std::ranges::unique(expected).begin(), expected.end());
  for (const Pull& pull : ndt::pulls_on(objective, scan, Pose())) elements.push_back(pull.element);
  CHECK(elements.size() > 100);
  CHECK(elements == expected);
}

TEST_CASE("with a part of its elements a map scores nearly as with all, and aligns") {
  const PointCloud cloud = test::yard(51);
  const PointCloud scan = test::seen_from(test::yard(52), kTruth, 18.0, 4000, 1);
  const auto whole = test::prepared(cloud);
  const ScanScore expected = whole->score(scan, kTruth).value();
  CHECK(expected.compared == 1.0);
  std::mt19937 random(1);
  for (const std::uint32_t step : {1U, 3U, 10U}) {
    CAPTURE(step);
    const auto kept = one_in(whole->elements(), step);
    const auto excerpt = whole->excerpt_of(all_of(*whole), kept);
    REQUIRE(excerpt);
    CHECK(excerpt->elements == kept.size());
    const auto some = restored(excerpt->bytes);
    CHECK(some->elements() == kept.size());
    const ScanScore score = some->score(scan, kTruth).value();
    CHECK(score.coverage == doctest::Approx(expected.coverage).epsilon(1e-9));
    CHECK(score.nvtl == doctest::Approx(expected.nvtl).epsilon(0.1));
    CHECK(score.compared == doctest::Approx(1.0 / step).epsilon(0.3));
    // A wrong pose does not look better than with all elements.
    Pose wrong = kTruth;
    wrong.translation += Point(2.0, 1.0, 0.0);
    CHECK(some->score(scan, wrong)->nvtl < 1.25 * whole->score(scan, wrong)->nvtl);
    const auto alignment = some->align(scan, test::disturbed(kTruth, 0.3, 2.0, random));
    REQUIRE(alignment);
    CHECK((alignment->T_map_scan.translation - kTruth.translation).norm() < 0.03);
  }
}

TEST_CASE("an element that is kept takes less than 15 bytes, one that is not a few bits") {
  const PointCloud cloud = test::yard(51);
  const auto whole = test::prepared(cloud);
  const auto size_of = [&](std::uint32_t step) {
    return static_cast<double>(
        whole->excerpt_of(all_of(*whole), one_in(whole->elements(), step))->bytes.size());
  };
  const auto elements = static_cast<double>(whole->elements());
  CHECK(size_of(1) - size_of(10) < 15.0 * 0.9 * elements);
  CHECK(size_of(10) < (1.5 + 0.6) * elements + 200.0);
}

TEST_CASE("a part that is damaged is refused or restored, never more") {
  const PointCloud cloud = test::yard(51);
  const auto whole = test::prepared(cloud);
  const auto excerpt = whole->excerpt_of(all_of(*whole), one_in(whole->elements(), 7)).value();
  const auto matcher = test::plugin<ScanMatcher>("ndt", "");
  for (std::size_t size = 0; size < excerpt.bytes.size(); size += 97) {
    const auto target = matcher->restore(std::span(excerpt.bytes).first(size));
    REQUIRE(!target);
    CHECK(target.error().code == ErrorCode::corrupt_data);
  }
  CHECK(whole->excerpt_of(all_of(*whole), {})->elements == 0);
  const auto nothing = matcher->restore(whole->excerpt_of(all_of(*whole), {})->bytes);
  REQUIRE(!nothing);
  CHECK(nothing.error().code == ErrorCode::too_few_matches);
}

TEST_CASE("elements are told with their places, and a point that is not finite is refused") {
  const PointCloud cloud = test::yard(51);
  const auto whole = test::prepared(cloud);
  const auto elements = whole->elements_at(cloud).value();
  REQUIRE(elements.size() == whole->elements());
  CHECK(std::ranges::is_sorted(elements, {}, &MapElement::number));
  for (const MapElement& element : elements) {
    CHECK(element.points >= 6);
    const auto at = whole->elements_at(std::vector<Point>{element.middle}).value();
    REQUIRE(at.size() == 1);
    CHECK(at.front().number == element.number);
  }
  const PointCloud bad{{0.0, std::numeric_limits<double>::quiet_NaN(), 0.0}};
  CHECK(whole->elements_at(bad).error().code == ErrorCode::invalid_input);
  const std::vector<std::uint32_t> seen{1, 5}, other{2}, twice{5, 5}, beyond{1, 1'000'000};
  for (const auto& [which, kept] : {std::pair{seen, other}, {seen, twice}, {beyond, seen}}) {
    CHECK(whole->excerpt_of(which, kept).error().code == ErrorCode::invalid_input);
  }
  CHECK(whole->pulls(bad, kTruth).error().code == ErrorCode::invalid_input);
}

}  // namespace vantage::some_elements
