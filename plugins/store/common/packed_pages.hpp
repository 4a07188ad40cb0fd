#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "vantage/kit/checksum.hpp"

/// The pages of a packed index, as its writer and its reader see them. Numbers are little endian.
namespace vantage::bundle_folder::packed {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

inline constexpr std::size_t kPage = 4096;                              // [bytes]
inline constexpr std::size_t kContent = kPage - sizeof(std::uint64_t);  // before its checksum
inline constexpr std::array<char, 16> kTitle{'v', 'a', 'n', 't', 'a', 'g', 'e', ' ',
                                             'r', 'e', 'g', 'i', 'o', 'n', 's', '\n'};

/// The last page.
struct Summary {
  std::array<char, 16> title;
  std::uint64_t version, regions, entries_bytes;
  std::uint64_t content;  // checksum of the checksums of all entries, then of all pages before this
  std::uint64_t empty, without_points, least_points, most_points, points, viewpoints, elements,
      bytes, max_views;
  std::array<double, 4> extent;  // least x, y, largest x, y
};
inline constexpr std::uint64_t kVersion = 3;

/// A page of the tree begins with this.
struct Node {
  std::uint32_t children, level;  // level 0: the children are regions
};
struct Child {
  std::array<double, 4> box;  // least x, y, largest x, y
  std::uint32_t region;       // of level 0; else 0
  std::uint32_t unused;
};
inline constexpr std::size_t kChildren = (kContent - sizeof(Node)) / sizeof(Child);

/// A label's hash and its region.
struct Label {
  std::uint64_t hash;
  std::uint32_t region, unused;
};
inline constexpr std::size_t kLabels = kContent / sizeof(Label);
inline constexpr std::size_t kOffsets = kContent / sizeof(std::uint64_t);

[[nodiscard]] constexpr std::uint64_t pages_for(std::uint64_t count, std::uint64_t in_page) {
  return count / in_page + (count % in_page > 0 ? 1 : 0);
}

/// Where everything is. It follows from two numbers, so nothing in a file can say otherwise: each
/// page of the tree but the root has one parent, and the tree ends.
struct Layout {
  struct Level {
    std::uint64_t first = 0, pages = 0;  // the number of its first page; of its pages
    std::uint64_t children = 0;          // of all its pages: each has as many as fit but the last
  };
  std::uint64_t first_offsets = 0;
  std::vector<Level> levels;  // the leaves first; the last has one page, the root
  std::uint64_t first_labels = 0, last = 0;

  /// Precondition: there are regions.
  [[nodiscard]] static Layout of(std::uint64_t regions, std::uint64_t entries_bytes) {
    Layout layout;
    layout.first_offsets = pages_for(entries_bytes, kPage);
    std::uint64_t next = layout.first_offsets + pages_for(regions + 1, kOffsets);
    for (std::uint64_t children = regions;;) {
      const std::uint64_t pages = pages_for(children, kChildren);
      layout.levels.push_back({.first = next, .pages = pages, .children = children});
      next += pages;
      if (pages == 1) break;
      children = pages;
    }
    layout.first_labels = next;
    layout.last = next + pages_for(regions, kLabels);
    return layout;
  }
};

/// Of a page, and of its number: a page that lies in the place of another is damage.
[[nodiscard]] inline std::uint64_t sum_of_page(const char* content, std::uint64_t number) noexcept {
  Checksum sum;
  sum.add(number);
  sum.add(std::string_view(content, kContent));
  return sum.value();
}

template <class T>
void put(std::string& to, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
[[nodiscard]] T get(const char* from) noexcept {
  static_assert(std::is_trivially_copyable_v<T>);
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

}  // namespace vantage::bundle_folder::packed
