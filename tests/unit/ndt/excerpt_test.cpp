#include "excerpt.hpp"

#include <doctest/doctest.h>
#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "scenes.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

using Bytes = std::vector<std::byte>;

const Pose kTruth = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});

PluginPtr<MatchTarget> restored(std::span<const std::byte> bytes, const std::string& toml = {}) {
  const auto matcher = test::plugin<ScanMatcher>("ndt", toml);
  return in_library_of(matcher, matcher->restore(bytes).value());
}

ErrorCode refusal(std::span<const std::byte> bytes, const std::string& toml = {}) {
  const auto target = test::plugin<ScanMatcher>("ndt", toml)->restore(bytes);
  REQUIRE(!target);
  return target.error().code;
}

/// An excerpt of a few voxels.
Bytes small() {
  const auto map = ndt::VoxelMap::build(test::yard(51), {}).value();
  const std::vector<std::uint32_t> which{0, 1, 5, 90, 400};
  return ndt::encode(map, which);
}

bool same(const ndt::VoxelMap& a, const ndt::VoxelMap& b) {
  return std::ranges::equal(a.keys(), b.keys()) && std::ranges::equal(a.cells(), b.cells()) &&
         a.origin_voxel() == b.origin_voxel() && a.options() == b.options();
}

/// The checksum made right again, for what it would otherwise hide.
Bytes sealed(Bytes bytes) {
  // As README.md says.
  std::uint64_t sum = 0xCBF29CE484222325U;
  const auto mix = [&](std::uint64_t word) {
    sum = (sum ^ word) * 0x9E3779B97F4A7C15U;
    sum ^= sum >> 32U;
  };
  const std::size_t size = bytes.size() - 8;
  for (std::size_t i = 0; i <= size / 8; ++i) {
    std::uint64_t word = 0;
    for (std::size_t k = 8 * i; k < std::min(8 * i + 8, size); ++k) {
      word |= std::to_integer<std::uint64_t>(bytes[k]) << (8 * (k % 8));
    }
    mix(word);
  }
  mix(size);
  for (std::size_t k = 0; k < 8; ++k) bytes[size + k] = static_cast<std::byte>(sum >> (8 * k));
  return bytes;
}

}  // namespace

TEST_CASE("an excerpt of everything restores the map bit for bit") {
  const PointCloud cloud = test::yard(51);
  const PointCloud scan = test::seen_from(test::yard(52), kTruth, 18.0, 4000, 1);
  std::mt19937 random(1);
  const Pose guess = test::disturbed(kTruth, 0.3, 2.0, random);
  for (const std::string mode : {"direct7", "direct1", "direct26", "kdtree"}) {
    CAPTURE(mode);
    const std::string toml = "neighbours = \"" + mode + "\"";
    const auto whole = test::prepared(cloud, toml);
    const auto excerpt = whole->excerpt(cloud);
    REQUIRE(excerpt);
    CHECK(excerpt->elements == whole->elements());
    const auto again = restored(excerpt->bytes, toml);
    CHECK(again->elements() == whole->elements());
    CHECK(again->bytes() > 0);
    const auto expected = whole->align(scan, guess), got = again->align(scan, guess);
    REQUIRE(expected);
    REQUIRE(got);
    CHECK(got->T_map_scan.translation == expected->T_map_scan.translation);
    CHECK(got->T_map_scan.rotation.coeffs() == expected->T_map_scan.rotation.coeffs());
    CHECK(got->hessian == expected->hessian);
    CHECK(got->score.fitness == expected->score.fitness);
    // And what is restored gives the same bytes.
    CHECK(again->excerpt(cloud).value() == *excerpt);
  }
}

TEST_CASE("an excerpt does not depend on how far the map extends") {
  const PointCloud yard = test::yard(51);
  PointCloud larger = yard;
  for (int k = 0; k < 50; ++k) larger.emplace_back(300.0 + 0.01 * k, -77.0 + 0.01 * (k % 7), 0.3);
  const PointCloud seen(yard.begin() + 100, yard.begin() + 900);
  const auto excerpt = test::prepared(yard)->excerpt(seen).value();
  CHECK(excerpt.elements > 5);
  CHECK(test::prepared(larger)->excerpt(seen).value() == excerpt);
}

TEST_CASE("an excerpt does not depend on the neighbours, nor on the order of what is seen") {
  PointCloud cloud = test::yard(51);
  const auto target = test::prepared(cloud, "neighbours = \"direct1\"");
  const auto excerpt = target->excerpt(cloud).value();
  CHECK(test::prepared(cloud, "neighbours = \"kdtree\"")->excerpt(cloud).value() == excerpt);
  std::shuffle(cloud.begin(), cloud.end(), std::mt19937(3));
  CHECK(target->excerpt(cloud).value() == excerpt);
  CHECK(restored(excerpt.bytes, "neighbours = \"direct26\"")->elements() == excerpt.elements);
}

TEST_CASE("an excerpt holds the voxels of what is seen, with the whole map's statistics") {
  const auto map = ndt::VoxelMap::build(test::yard(51), {}).value();
  const auto inside = [&](std::size_t i, double at) -> Point {
    return map.origin() + ndt::VoxelMap::corner_of(map.keys()[i]) + Point::Constant(at);
  };
  PointCloud seen{inside(200, 0.1), inside(40, 0.9), inside(200, 0.8), {500.0, 0.0, 0.0}};
  const auto which = ndt::gaussians_at(map, seen);
  REQUIRE(which == std::vector<std::uint32_t>{40, 200});
  const auto part = ndt::decode(ndt::encode(map, which), map.options());
  REQUIRE(part);
  const auto corner = [](const ndt::VoxelMap& of, std::size_t i) -> Point {
    return of.origin() + ndt::VoxelMap::corner_of(of.keys()[i]);
  };
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(corner(*part, i) == corner(map, which[i]));
    CHECK(part->cells()[i] == map.cells()[which[i]]);
  }

  const auto target = test::prepared(test::yard(51));
  CHECK(target->excerpt(seen).value().elements == 2);
  seen[1].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(target->excerpt(seen).error().code == ErrorCode::invalid_input);
}

TEST_CASE("a cell costs less than 24 bytes, also millions of metres away") {
  for (const double by : {0.0, 4e6}) {
    const auto map =
        ndt::VoxelMap::build(test::shifted(test::yard(51), {by, -by, 0.0}), {}).value();
    std::vector<std::uint32_t> all(map.cells().size());
    std::iota(all.begin(), all.end(), 0U);
    const Bytes bytes = ndt::encode(map, all);
    CHECK(bytes.size() < 24 * all.size());
    const auto again = ndt::decode(bytes, map.options());
    REQUIRE(again);
    CHECK(same(*again, map));
  }
}

TEST_CASE("what nothing was seen of is too_few_matches to restore") {
  const auto target = test::prepared(test::yard(51));
  for (const PointCloud& seen : {PointCloud{}, PointCloud{{900.0, 0.0, 0.0}}}) {
    const auto excerpt = target->excerpt(seen);
    REQUIRE(excerpt);
    CHECK(excerpt->elements == 0);
    CHECK(refusal(excerpt->bytes) == ErrorCode::too_few_matches);
  }
}

TEST_CASE("an excerpt made with other parameters is refused, and the message names both") {
  const Bytes bytes = small();
  for (const char* toml :
       {"resolution = 2.0", "min_points_per_voxel = 7", "eigenvalue_floor = 0.02"}) {
    CAPTURE(toml);
    CHECK(refusal(bytes, toml) == ErrorCode::invalid_input);
  }
  const auto target = test::plugin<ScanMatcher>("ndt", "resolution = 2.0")->restore(bytes);
  REQUIRE(!target);
  CHECK(target.error().message.find("resolution 1.0") != std::string::npos);
  CHECK(target.error().message.find("resolution 2.0") != std::string::npos);
  CHECK(restored(bytes, "outlier_ratio = 0.3\nmax_iterations = 3")->elements() == 5);
}

TEST_CASE("a damaged or cut excerpt is corrupt_data, whatever byte it is") {
  const Bytes bytes = small();
  const ndt::VoxelOptions options;
  REQUIRE(ndt::decode(bytes, options));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const auto cut = ndt::decode(std::span(bytes).first(length), options);
    REQUIRE(!cut);
    CHECK(cut.error().code == ErrorCode::corrupt_data);
  }
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      Bytes damaged = bytes;
      damaged[i] ^= static_cast<std::byte>(1 << bit);
      const auto read = ndt::decode(damaged, options);
      REQUIRE(!read);
      CHECK(read.error().code == ErrorCode::corrupt_data);
    }
  }
  Bytes longer = bytes;
  longer.push_back(std::byte{0});
  CHECK(ndt::decode(longer, options).error().code == ErrorCode::corrupt_data);
  CHECK(refusal({}) == ErrorCode::corrupt_data);
}

TEST_CASE("damage under a right checksum is an error or a map, never a crash") {
  const Bytes bytes = small();
  REQUIRE(sealed(bytes) == bytes);
  const PointCloud scan = test::seen_from(test::yard(52), kTruth, 18.0, 500, 1);
  std::mt19937 random(5);
  std::uniform_int_distribution<int> any(0, 255);
  std::size_t refused = 0, read = 0;
  const auto attempt = [&](Bytes damaged) {
    const auto map = ndt::decode(sealed(std::move(damaged)), {});
    if (!map) {
      ++refused;
      return;
    }
    ++read;
    CHECK(map->keys().size() == 5);
    for (const ndt::Cell& cell : map->cells()) {
      const ndt::Gaussian g = ndt::gaussian_of(cell);
      CHECK(std::isfinite(g.xx + g.xy + g.xz + g.yy + g.yz + g.zz));
    }
  };
  for (std::size_t i = 0; i + 8 < bytes.size(); ++i) {
    for (int round = 0; round < 8; ++round) {
      Bytes damaged = bytes;
      damaged[i] = static_cast<std::byte>(any(random));
      attempt(std::move(damaged));
    }
  }
  CHECK(refused > 200);
  CHECK(read > 200);
  for (std::size_t length = 64; length < bytes.size(); ++length) {
    CHECK(
        !ndt::decode(sealed(Bytes(bytes.begin(), bytes.begin() + static_cast<long>(length))), {}));
  }
}

TEST_CASE("the format's first bytes are what README.md says") {
  const Bytes bytes = small();
  CHECK(std::memcmp(bytes.data(), "VNDT\1\0\0\0", 8) == 0);
  const auto real = [&](std::size_t at) {
    std::uint64_t bits = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      bits |= std::to_integer<std::uint64_t>(bytes[at + k]) << (8 * k);
    }
    return std::bit_cast<double>(bits);
  };
  CHECK(real(8) == 1.0);
  CHECK(real(16) == 0.01);
  CHECK(real(24) == std::round(real(24)));
  CHECK(bytes[48] == std::byte{6});
  CHECK(bytes[52] == std::byte{5});
}

}  // namespace vantage
