// The code of occupied voxels: its bytes stay as they are in stored maps, and damaged bytes are
// refused.
#include "occupancy.hpp"

#include <doctest/doctest.h>
#include <algorithm>
#include <array>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "excerpt.hpp"
#include "vantage/kit/bit_coder.hpp"

namespace vantage::occupancy {
namespace {

using Keys = std::vector<std::uint64_t>;
using Bytes = std::vector<std::byte>;
using Index = std::array<std::uint32_t, 3>;

Index index_of(std::uint64_t key) {
  const auto axis = [&](unsigned block, unsigned place) {
    return static_cast<std::uint32_t>((key >> block & 0x7FFFFU) << 2U | (key >> place & 3U));
  };
  return {axis(44, 4), axis(25, 2), axis(6, 0)};
}

/// As plugins/matcher/ndt/README.md says, with sets of nodes.
Bytes plainly_encoded(const Keys& keys) {
  BitEncoder encoder;
  std::set<Index> level{Index{}};
  std::vector<Index> order{Index{}};
  for (unsigned shift = 21; shift-- > 0;) {
    std::set<Index> below;
    for (const std::uint64_t key : keys) {
      const Index at = index_of(key);
      below.insert({at[0] >> shift, at[1] >> shift, at[2] >> shift});
    }
    std::array<Chance, 64> chances;
    std::vector<Index> next;
    for (const Index& node : order) {
      for (unsigned child = 0; child < 8; ++child) {
        Index at{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          at[axis] = 2 * node[axis] + (child >> (2 - axis) & 1U);
        }
        unsigned context = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          Index before = at, after = node;
          --before[axis];
          ++after[axis];
          if (at[axis] > 0 && below.contains(before)) context |= 1U << axis;
          if (at[axis] % 2 == 1 && level.contains(after)) context |= 8U << axis;
        }
        if (encoder.code(chances[context], below.contains(at))) next.push_back(at);
      }
    }
    level = std::move(below);
    order = std::move(next);
  }
  return std::move(encoder).finish();
}

struct Set {
  std::string name;
  Keys keys;  // ascending
};

/// @param place  of random voxels
Set some_voxels(const std::string& name, std::size_t count, auto place) {
  std::mt19937 random(7);
  std::set<std::uint64_t> keys;
  for (std::size_t i = 0; i < count; ++i) {
    const Index at = place(random);
    keys.insert(ndt::key_of_shifted(at[0], at[1], at[2]));
  }
  return {name, {keys.begin(), keys.end()}};
}

std::vector<Set> sets() {
  constexpr std::uint32_t kMiddle = 1U << 20U, kLast = ndt::kIndexEnd - 1;
  const auto below = [](std::mt19937& random, std::uint32_t end) {
    return static_cast<std::uint32_t>(random()) % end;
  };
  const auto cube = [&](std::uint32_t from, std::uint32_t size) {
    return [=](std::mt19937& random) {
      const auto in = [&] { return from + below(random, size); };
      return Index{in(), in(), in()};
    };
  };
  const auto corner = [&](std::mt19937& random) {
    const auto end = [&] { return below(random, 2) == 0 ? 1U : kLast; };
    return Index{end(), end(), end()};
  };
  const auto street = [&](std::mt19937& random) {
    const std::uint32_t x = kMiddle - 50 + below(random, 101);
    const std::uint32_t y = kMiddle - 50 + below(random, 101);
    const std::uint32_t z = kMiddle + (x + y) / 64 % 4;
    return below(random, 3) > 0 ? Index{x, y, z}
                                : Index{x, kMiddle + 20 - x / 16 % 2, z + below(random, 12)};
  };
  return {some_voxels("none", 0, corner),
          some_voxels("one", 1, cube(kMiddle, 1)),
          some_voxels("corners of the grid", 100, corner),
          some_voxels("anywhere in the grid", 300, cube(1, kLast)),
          some_voxels("sparse", 2000, cube(kMiddle - 16, 32)),
          some_voxels("full", 20'000, cube(kMiddle - 5, 11)),
          some_voxels("ground and a wall", 6000, street)};
}

std::uint64_t hash_of(const Bytes& bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;  // FNV-1a, with which kHashes was made
  for (const std::byte byte : bytes) {
    hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3U;
  }
  return hash;
}

/// A map with cells of any numbers.
ndt::VoxelMap map_of(const Keys& keys) {
  std::mt19937 random(8);
  const auto number = [&](std::uint32_t below) {
    return static_cast<std::uint32_t>(random()) % below;
  };
  PageVector<ndt::Cell> cells(keys.size());
  for (ndt::Cell& cell : cells) {
    for (auto& x : cell.mean) x = static_cast<std::uint16_t>(number(65536));
    for (auto& x : cell.lower) x = static_cast<std::int16_t>(number(65536));
    for (auto& x : cell.diagonal) x = static_cast<std::uint16_t>(1 + number(65535));
    cell.exponent = static_cast<std::uint8_t>(number(32));
    cell.points = 6 + number(1000);
  }
  return {{}, Eigen::Vector3d(7, -300, 12), {keys.begin(), keys.end()}, std::move(cells)};
}

}  // namespace

TEST_CASE("the code of occupied voxels is that of a plain octree, and they come back") {
  for (const Set& set : sets()) {
    CAPTURE(set.name);
    const Keys& keys = set.keys;
    const Bytes bytes = ndt::encode_occupancy(keys);
    CHECK(bytes == plainly_encoded(keys));
    CHECK(ndt::decode_occupancy(bytes, keys.size()) == keys);
    Keys shuffled = keys;
    std::ranges::shuffle(shuffled, std::mt19937(4));
    CHECK(ndt::encode_occupancy(shuffled) == bytes);
  }
}

TEST_CASE("stored maps of some elements have the same bytes as ever") {
  struct Hashes {
    std::uint64_t code, map;
  };
  constexpr std::array<Hashes, 7> kHashes{{
      {0x7B3F425D277A8848, 0xDDAB171CA2AC11DA},
      {0xA5CCB38E2F279E1A, 0xA3A2EEA2890331D9},
      {0x1BAFDA55FF955BF4, 0x67DD7EE1F82DB9FF},
      {0xDD5723D5BE5CD893, 0x8452EDE0A7A77B37},
      {0xFA65238418DD699D, 0x97E58803CF2D4872},
      {0x4725D5CA53675979, 0x9187588F8FC06B91},
      {0x7FC7BAAA18A779D6, 0xC12C27BB140237B2},
  }};
  const std::vector<Set> all_sets = sets();
  REQUIRE(all_sets.size() == kHashes.size());
  for (std::size_t k = 0; k < kHashes.size(); ++k) {
    CAPTURE(all_sets[k].name);
    const Keys& keys = all_sets[k].keys;
    CHECK(hash_of(ndt::encode_occupancy(keys)) == kHashes[k].code);
    std::vector<std::uint32_t> all(keys.size()), some;
    std::iota(all.begin(), all.end(), 0U);
    for (std::uint32_t i = 0; i < keys.size(); i += 1 + i % 5) some.push_back(i);
    CHECK(hash_of(ndt::encode_some(map_of(keys), all, some)) == kHashes[k].map);
  }
}

TEST_CASE("a promise of more voxels than there are is refused, and takes no memory") {
  for (const Set& set : sets()) {
    CAPTURE(set.name);
    const Keys& keys = set.keys;
    const Bytes bytes = ndt::encode_occupancy(keys);
    for (const std::size_t count : {keys.size() + 1, std::size_t{0xFFFFFFFF}}) {
      CHECK_FALSE(ndt::decode_occupancy(bytes, count));
      CHECK_FALSE(ndt::decode_occupancy(std::span(bytes).first(bytes.size() - 1), count));
    }
  }
}

TEST_CASE("damaged codes are refused, or are the code of the voxels that they give") {
  std::mt19937 random(9);
  for (const Set& set : sets()) {
    CAPTURE(set.name);
    const Keys& keys = set.keys;
    const Bytes bytes = ndt::encode_occupancy(keys);
    for (int round = 0; round < 200; ++round) {
      Bytes damaged = bytes;
      damaged[random() % damaged.size()] ^= std::byte(1 + random() % 255);
      const auto decoded = ndt::decode_occupancy(damaged, keys.size());
      if (decoded) CHECK(ndt::encode_occupancy(*decoded) == damaged);
    }
  }
}

}  // namespace vantage::occupancy
