#include "occupancy.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "vantage/kit/bit_coder.hpp"

namespace vantage::ndt {
namespace {

constexpr unsigned kLevels = 21;  // an index along an axis has so many bits

/// The way from the root of the octree to a node: the number of a child at each level, 3 bits each.
/// The child in the upper half along x, y and z has the number 4 x + 2 y + z.
using Code = std::uint64_t;

constexpr std::uint64_t kEachThird = 0x1249249249249249U;
/// The lowest 21 bits, with two zeros between each.
constexpr std::uint64_t spread(std::uint64_t index) noexcept {
  index &= 0x1FFFFFU;
  index = (index | index << 32U) & 0x001F00000000FFFFU;
  index = (index | index << 16U) & 0x001F0000FF0000FFU;
  index = (index | index << 8U) & 0x100F00F00F00F00FU;
  index = (index | index << 4U) & 0x10C30C30C30C30C3U;
  return (index | index << 2U) & kEachThird;
}
/// The inverse; it ignores the bits between.
constexpr std::uint64_t gathered(std::uint64_t bits) noexcept {
  bits &= kEachThird;
  bits = (bits | bits >> 2U) & 0x10C30C30C30C30C3U;
  bits = (bits | bits >> 4U) & 0x100F00F00F00F00FU;
  bits = (bits | bits >> 8U) & 0x001F0000FF0000FFU;
  bits = (bits | bits >> 16U) & 0x001F00000000FFFFU;
  return (bits | bits >> 32U) & 0x1FFFFFU;
}

constexpr unsigned kBlockBits = 19;  // of a block's index along an axis
constexpr std::uint64_t kBlockMask = (1U << kBlockBits) - 1U;
Code code_of_block(std::uint64_t key) noexcept {
  return spread(key >> 2U * kBlockBits & kBlockMask) << 2U |
         spread(key >> kBlockBits & kBlockMask) << 1U | spread(key & kBlockMask);
}
std::uint64_t key_of_block(Code code) noexcept {
  return gathered(code >> 2U) << 2U * kBlockBits | gathered(code >> 1U) << kBlockBits |
         gathered(code);
}

/// The voxels of a block, a bit for each of its places (see key_of_shifted).
struct Places {
  std::uint64_t block = 0;  // its key or its code
  std::uint64_t voxels = 0;
};
/// A block has eight children of eight voxels each. Where the first voxel of a child is.
constexpr unsigned place_of_child(unsigned child) noexcept {
  return (child & 4U) << 3U | (child & 2U) << 2U | (child & 1U) << 1U;
}
/// The voxels of the first child, from a bit for each of their numbers to one for each place.
constexpr std::uint64_t to_places(unsigned voxels) noexcept {
  return (voxels & 0x03U) | (voxels & 0x0CU) << 2U | (voxels & 0x30U) << 12U |
         (voxels & 0xC0U) << 14U;
}
/// The inverse; it ignores the voxels of other children.
constexpr std::uint8_t from_places(std::uint64_t places) noexcept {
  return static_cast<std::uint8_t>((places & 0x03U) | (places >> 2U & 0x0CU) |
                                   (places >> 12U & 0x30U) | (places >> 14U & 0xC0U));
}

/// An occupied node of the octree. It knows its neighbours and its children by their places in
/// their levels, so nothing is searched.
struct Node {
  Code code = 0;
  std::array<std::uint32_t, 3> before{};  // neighbours one down along x, y, z
  std::uint32_t first_child = 0;
  std::uint8_t children = 0;  // a bit for each child: is it occupied?
  std::uint8_t after = 0;     // bits 0 to 2 for the neighbours one up along x, y, z: likewise
};
/// Nodes in the order of their codes. The first has no children and stands for all that are not
/// occupied.
using Level = std::vector<Node>;

/// How many are set. std::popcount is a function call on processors without POPCNT.
constexpr unsigned count_of(std::uint8_t bits) noexcept {
  unsigned sum = bits - (bits >> 1U & 0x55U);
  sum = (sum & 0x33U) + (sum >> 2U & 0x33U);
  return (sum + (sum >> 4U)) & 0x0FU;
}

/// Its place in the level below.
std::uint32_t child_of(const Node& node, unsigned child) noexcept {
  const auto lower = static_cast<std::uint8_t>(node.children & ((1U << child) - 1U));
  return (node.children >> child & 1U) != 0 ? node.first_child + count_of(lower) : 0;
}

Level level_below(const Level& level) {
  Level below(1);
  below.reserve(level.back().first_child + std::size_t{8});
  for (const Node& node : level) {
    for (unsigned rest = node.children; rest != 0; rest &= rest - 1) {
      const auto child = static_cast<unsigned>(std::countr_zero(rest));
      Node added{.code = node.code << 3U | child};
      for (unsigned axis = 0; axis < 3; ++axis) {
        const unsigned upper = 4U >> axis;
        const Node& parent = (child & upper) != 0 ? node : level[node.before[axis]];
        added.before[axis] = child_of(parent, child ^ upper);
        below[added.before[axis]].after |= static_cast<std::uint8_t>(1U << axis);
      }
      below.push_back(added);
    }
  }
  return below;
}

/// Codes which children of a node are occupied, in the order of their numbers, each with what is
/// known of its neighbours: those before it on its own level, those after it on the level above.
/// @param wanted  only an encoder reads it
template <class Coder>
std::uint8_t code_children(Coder& coder, std::array<Chance, 64>& chances, const Level& level,
                           const Node& node, unsigned wanted) {
  const auto before = [&](std::size_t axis) { return unsigned{level[node.before[axis]].children}; };
  // A bit for each child: is the neighbour before it occupied? That of a lower child is an upper
  // child of the node before, that of an upper child its sibling.
  unsigned x = before(0) >> 4U, y = before(1) >> 2U & 0x33U, z = before(2) >> 1U & 0x55U;
  unsigned children = 0;
#pragma GCC unroll 8
  for (unsigned child = 0; child < 8; ++child) {
    const unsigned upper = (child & 4U) >> 2U | (child & 2U) | (child & 1U) << 2U;
    const unsigned context = (x >> child & 1U) | (y >> child & 1U) << 1U | (z >> child & 1U) << 2U |
                             (node.after & upper) << 3U;
    const unsigned bit = coder.code(chances[context], (wanted >> child & 1U) != 0) ? 1U : 0U;
    children |= bit << child;
    if ((child & 4U) == 0) x |= bit << (child + 4U);
    if ((child & 2U) == 0) y |= bit << (child + 2U);
    if ((child & 1U) == 0) z |= bit << (child + 1U);
  }
  return static_cast<std::uint8_t>(children);
}

/// A level with its children; no value if they are more than `most`.
/// @param wanted  children of each node; empty for a decoder
template <class Coder>
std::optional<Level> coded(Coder& coder, Level level, std::span<const std::uint8_t> wanted,
                           std::size_t most) {
  std::array<Chance, 64> chances;
  std::size_t sum = 0;
  for (std::size_t i = 1; i < level.size(); ++i) {
    if (coder.is_cut_off()) return std::nullopt;  // it would go on with bits that are not there
    Node& node = level[i];
    const unsigned wanted_here = wanted.empty() ? 0U : wanted[i - 1];
    node.children = code_children(coder, chances, level, node, wanted_here);
    node.first_child = static_cast<std::uint32_t>(1 + sum);
    sum += count_of(node.children);
    if (sum > most) return std::nullopt;
  }
  return level;
}

/// Of each level above the voxels, the root first: the children of its nodes, a bit each.
using Children = std::array<std::vector<std::uint8_t>, kLevels>;

/// Codes the octree level by level, the root first.
/// @param wanted  of each level, for an encoder
/// @return        the lowest level; no value if there are more than `most` nodes in a level
template <class Coder>
std::optional<Level> code_octree(Coder& coder, const Children& wanted, std::size_t most) {
  std::optional<Level> level = coded(coder, Level(2), wanted[0], most);
  for (unsigned depth = 1; level && depth < kLevels; ++depth) {
    level = coded(coder, level_below(*level), wanted[depth], most);
  }
  return level;
}

/// The occupied voxels of blocks, in the order of their keys.
std::vector<std::uint64_t> keys_below(const Level& level) {
  std::vector<Places> blocks;
  std::size_t sum = 0;
  for (const Node& node : std::span(level).subspan(1)) {
    const Code block = node.code >> 3U;
    if (blocks.empty() || blocks.back().block != block) blocks.push_back({block, 0});
    blocks.back().voxels |= to_places(node.children) << place_of_child(node.code & 7U);
    sum += count_of(node.children);
  }
  for (Places& places : blocks) places.block = key_of_block(places.block);
  std::ranges::sort(blocks, {}, &Places::block);
  std::vector<std::uint64_t> keys;
  keys.reserve(sum);
  for (const Places& places : blocks) {
    for (std::uint64_t rest = places.voxels; rest != 0; rest &= rest - 1) {
      keys.push_back(places.block << 6U | static_cast<unsigned>(std::countr_zero(rest)));
    }
  }
  return keys;
}

/// The blocks of voxels, in the order of their codes.
/// @param keys  ascending
std::vector<Places> blocks_of(std::span<const std::uint64_t> keys) {
  std::vector<Places> blocks;
  for (const std::uint64_t key : keys) {
    if (blocks.empty() || blocks.back().block != key >> 6U) blocks.push_back({key >> 6U, 0});
    blocks.back().voxels |= std::uint64_t{1} << (key & 63U);
  }
  for (Places& places : blocks) places.block = code_of_block(places.block);
  std::ranges::sort(blocks, {}, &Places::block);
  return blocks;
}

/// Nodes of a level that have occupied children, in the order of their codes.
struct Parents {
  std::vector<Code> codes;
  std::vector<std::uint8_t> children;
};
Parents parents_of_voxels(std::span<const Places> blocks) {
  Parents parents;
  for (const Places& places : blocks) {
    for (unsigned child = 0; child < 8; ++child) {
      const std::uint8_t voxels = from_places(places.voxels >> place_of_child(child));
      if (voxels == 0) continue;
      parents.codes.push_back(places.block << 3U | child);
      parents.children.push_back(voxels);
    }
  }
  return parents;
}
Parents parents_of_nodes(std::span<const Code> codes) {
  Parents parents;
  for (const Code code : codes) {
    if (parents.codes.empty() || parents.codes.back() != code >> 3U) {
      parents.codes.push_back(code >> 3U);
      parents.children.push_back(0);
    }
    parents.children.back() |= static_cast<std::uint8_t>(1U << (code & 7U));
  }
  return parents;
}

/// @param keys  ascending
Children children_of(std::span<const std::uint64_t> keys) {
  Children children;
  Parents parents = parents_of_voxels(blocks_of(keys));
  for (unsigned depth = kLevels; depth-- > 0;) {
    children[depth] = std::move(parents.children);
    parents = parents_of_nodes(parents.codes);
  }
  return children;
}

std::vector<std::byte> encode_ascending(std::span<const std::uint64_t> keys) {
  BitEncoder encoder;
  (void)code_octree(encoder, children_of(keys), keys.size());
  return std::move(encoder).finish();
}

}  // namespace

std::vector<std::byte> encode_occupancy(std::span<const std::uint64_t> keys) {
  if (std::ranges::is_sorted(keys)) return encode_ascending(keys);
  std::vector<std::uint64_t> ascending(keys.begin(), keys.end());
  std::ranges::sort(ascending);
  return encode_ascending(ascending);
}

std::optional<std::vector<std::uint64_t>> decode_occupancy(std::span<const std::byte> bytes,
                                                           std::size_t count) {
  BitDecoder decoder(bytes);
  const auto level = code_octree(decoder, Children{}, count);
  if (!level || !decoder.is_at_end()) return std::nullopt;
  std::vector<std::uint64_t> keys = keys_below(*level);
  if (keys.size() != count) return std::nullopt;
  return keys;
}

}  // namespace vantage::ndt
