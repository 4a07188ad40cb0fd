#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage {

/// A set of indices, with one bit per possible index. Adding the few points that a viewpoint sees
/// of a large map costs little.
class IndexSet {
 public:
  /// @param limit  larger than every index
  explicit IndexSet(std::size_t limit) : words_((limit + kBits - 1) / kBits) {}

  /// May run from many threads at once. Fastest for ascending indices.
  void add(std::span<const std::uint32_t> indices) noexcept {
    for (std::size_t i = 0; i < indices.size();) {
      const std::size_t word = indices[i] / kBits;
      std::uint64_t bits = 0;
      for (; i < indices.size() && indices[i] / kBits == word; ++i) {
        bits |= std::uint64_t{1} << (indices[i] % kBits);
      }
      const std::atomic_ref<std::uint64_t> shared(words_[word]);
      if ((shared.load(std::memory_order_relaxed) & bits) != bits) {
        shared.fetch_or(bits, std::memory_order_relaxed);
      }
    }
  }

  /// May run while other threads add; it may then miss an index that is being added.
  [[nodiscard]] bool contains(std::uint32_t index) const noexcept {
    // std::atomic_ref does not accept a const object, although it only reads here.
    auto& word = const_cast<std::uint64_t&>(words_[index / kBits]);
    const std::uint64_t bits = std::atomic_ref(word).load(std::memory_order_relaxed);
    return (bits >> (index % kBits) & 1U) != 0;
  }

  [[nodiscard]] std::size_t size() const noexcept {
    std::size_t count = 0;
    for (const std::uint64_t word : words_) count += static_cast<std::size_t>(std::popcount(word));
    return count;
  }

  /// Calls visit(index) for each index, in ascending order.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (std::size_t word = 0; word < words_.size(); ++word) {
      for (std::uint64_t bits = words_[word]; bits != 0; bits &= bits - 1) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(bits));
        visit(static_cast<std::uint32_t>(word * kBits + bit));
      }
    }
  }

  [[nodiscard]] IndexList ascending() const {
    IndexList indices;
    indices.reserve(size());
    for_each([&](std::uint32_t k) { indices.push_back(k); });
    return indices;
  }

 private:
  static constexpr std::size_t kBits = 64;
  std::vector<std::uint64_t> words_;
};

}  // namespace vantage
