#include "occupancy.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "vantage/kit/bit_coder.hpp"

namespace vantage::ndt {
namespace {

constexpr unsigned kLevels = 21;  // an index along an axis has so many bits

using Node = std::array<std::uint32_t, 3>;

Node index_of(std::uint64_t key) noexcept {
  const auto axis = [&](unsigned block, unsigned place) {
    return static_cast<std::uint32_t>((key >> block & 0x7FFFFU) << 2U | (key >> place & 3U));
  };
  return {axis(44, 4), axis(25, 2), axis(6, 0)};
}

/// A set of nodes of one level.
class Nodes {
 public:
  Nodes() { resize(256); }
  void add(const Node& node) {
    const std::uint64_t code = code_of(node);
    std::uint64_t& place = slots_[slot(code)];
    if (place == code) return;
    place = code;
    if (2 * ++size_ <= slots_.size()) return;
    const std::vector<std::uint64_t> before = std::move(slots_);
    resize(4 * before.size());
    for (const std::uint64_t old : before) {
      if (old != kFree) slots_[slot(old)] = old;
    }
  }
  [[nodiscard]] bool has(const Node& node) const noexcept {
    return slots_[slot(code_of(node))] != kFree;
  }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};
  static std::uint64_t code_of(const Node& n) noexcept {
    return (std::uint64_t{n[0]} << 42U) ^ (std::uint64_t{n[1]} << 21U) ^ n[2];
  }
  [[nodiscard]] std::size_t slot(std::uint64_t code) const noexcept {
    std::size_t at = code * 0x9E3779B97F4A7C15U >> shift_;
    while (slots_[at] != kFree && slots_[at] != code) at = (at + 1) & (slots_.size() - 1);
    return at;
  }
  void resize(std::size_t slots) {
    slots_.assign(slots, kFree);
    shift_ = static_cast<unsigned>(64 - std::countr_zero(slots));
  }

  std::vector<std::uint64_t> slots_;
  std::size_t size_ = 0;
  unsigned shift_ = 0;
};

/// One step aside; outside of the grid, an index that no node has.
Node beside(Node node, std::size_t axis, std::uint32_t step) noexcept {
  node[axis] += step;
  return node;
}

/// Codes the octree level by level, the root first. The children of a node are coded in the order
/// of their bits, each with what is known of its neighbours: before it on its own level, and after
/// it on the level above.
/// @param is_wanted  (node, level): whether the node is occupied; only asked by an encoder
/// @return           the occupied voxels; no value if there are more than `most` nodes in a level
template <class Coder, class IsWanted, class IsCutOff>
std::optional<std::vector<Node>> code_octree(Coder& coder, std::size_t most,
                                             const IsWanted& is_wanted,
                                             const IsCutOff& is_cut_off) {
  constexpr std::uint32_t kBack = ~std::uint32_t{0};
  std::vector<Node> nodes{Node{0, 0, 0}};
  Nodes above;
  above.add(nodes.front());
  for (unsigned level = kLevels; level-- > 0;) {
    std::array<Chance, 64> chances;
    std::vector<Node> next;
    Nodes here;
    for (const Node& node : nodes) {
      if (is_cut_off()) return std::nullopt;  // a decoder would go on with bits that are not there
      unsigned after = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        after |= (above.has(beside(node, axis, 1)) ? 1U : 0U) << axis;
      }
      for (unsigned child = 0; child < 8; ++child) {
        Node at;
        unsigned context = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          at[axis] = node[axis] << 1U | (child >> (2 - axis) & 1U);
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const bool upper = (at[axis] & 1U) != 0;
          context |= (here.has(beside(at, axis, kBack)) ? 1U : 0U) << axis;
          context |= (upper ? after >> axis & 1U : 0U) << (3 + axis);
        }
        if (!coder.code(chances[context], is_wanted(at, level))) continue;
        if (next.size() == most) return std::nullopt;
        next.push_back(at);
        here.add(at);
      }
    }
    nodes = std::move(next);
    above = std::move(here);
  }
  return nodes;
}

}  // namespace

std::vector<std::byte> encode_occupancy(std::span<const std::uint64_t> keys) {
  std::vector<Nodes> wanted;  // by level
  for (unsigned level = 0; level < kLevels; ++level) {
    Nodes& nodes = wanted.emplace_back();
    for (const std::uint64_t key : keys) {
      Node at = index_of(key);
      for (auto& x : at) x >>= level;
      nodes.add(at);
    }
  }
  BitEncoder encoder;
  (void)code_octree(
      encoder, keys.size(),
      [&](const Node& node, unsigned level) { return wanted[level].has(node); },
      [] { return false; });
  return std::move(encoder).finish();
}

std::optional<std::vector<std::uint64_t>> decode_occupancy(std::span<const std::byte> bytes,
                                                           std::size_t count) {
  BitDecoder decoder(bytes);
  const auto voxels = code_octree(
      decoder, count, [](const Node&, unsigned) { return false; },
      [&] { return decoder.is_cut_off(); });
  if (!voxels || voxels->size() != count || !decoder.is_at_end()) return std::nullopt;
  std::vector<std::uint64_t> keys;
  keys.reserve(count);
  for (const Node& at : *voxels) keys.push_back(key_of_shifted(at[0], at[1], at[2]));
  std::ranges::sort(keys);
  return keys;
}

}  // namespace vantage::ndt
