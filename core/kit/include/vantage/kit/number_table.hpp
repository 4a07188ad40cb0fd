#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace vantage {

/// Numbers keys 0, 1, 2, ... in the order in which they come. The caller holds the keys, and says
/// what they are: the table has numbers only (open addressing, at most half full).
class NumberTable {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;

  /// The number of a key; kNone for one that has none.
  /// @param hash    of the key
  /// @param is_key  whether a number is that of the key
  template <class IsKey>
  [[nodiscard]] std::uint32_t find(std::uint64_t hash, const IsKey& is_key) const {
    return slots_.empty() ? kNone : slots_[slot_of(hash, is_key)];
  }

  /// The number of a key; `size()` before the call for a new one.
  /// @param hash_of  the hash of the key of a number that was given out before
  template <class IsKey, class HashOf>
  std::uint32_t insert(std::uint64_t hash, const IsKey& is_key, const HashOf& hash_of) {
    if (2 * std::size_t{size_} >= slots_.size()) renumber(size_, hash_of);
    std::uint32_t& slot = slots_[slot_of(hash, is_key)];
    if (slot == kNone) slot = size_++;
    return slot;
  }

  /// Gives the numbers below `size` to keys that differ from each other.
  template <class HashOf>
  void renumber(std::uint32_t size, const HashOf& hash_of) {
    std::size_t slots = 1024;
    while (slots < 4 * std::size_t{size}) slots *= 2;
    slots_.assign(slots, kNone);
    size_ = size;
    const auto is_another = [](std::uint32_t) { return false; };
    for (std::uint32_t number = 0; number < size; ++number) {
      slots_[slot_of(hash_of(number), is_another)] = number;
    }
  }

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }

 private:
  template <class IsKey>
  [[nodiscard]] std::size_t slot_of(std::uint64_t hash, const IsKey& is_key) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = hash & mask;
    while (slots_[slot] != kNone && !is_key(slots_[slot])) slot = (slot + 1) & mask;
    return slot;
  }

  std::vector<std::uint32_t> slots_;  // as many as a power of two, or none
  std::uint32_t size_ = 0;
};

}  // namespace vantage
