#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace vantage {

/// @param bytes  a multiple of the size of a page
/// @return memory whose content is not defined
/// @throws std::bad_alloc
[[nodiscard]] void* take_pages(std::size_t bytes);
/// @param at  of `take_pages`, with as many bytes
void give_pages_back(void* at, std::size_t bytes) noexcept;

/// Allocates blocks of 4 KiB or more as pages of their own. They go back to the system when they
/// are freed, except for the last 2 MiB, which the next blocks are made of. A heap on which large
/// blocks come and go would keep the holes between them.
template <class T>
struct PageAllocator {
  using value_type = T;
  static constexpr std::size_t kPage = 4096;

  PageAllocator() = default;
  template <class U>
  PageAllocator(const PageAllocator<U>& /*other*/) noexcept {}  // NOLINT(*-explicit-*)

  /// What `n` elements take [bytes].
  [[nodiscard]] static constexpr std::size_t bytes(std::size_t n) noexcept {
    const std::size_t size = n * sizeof(T);
    return size < kPage ? size : (size + kPage - 1) / kPage * kPage;
  }
  [[nodiscard]] T* allocate(std::size_t n) {
    if (bytes(n) < kPage) return std::allocator<T>().allocate(n);
    return static_cast<T*>(take_pages(bytes(n)));
  }
  void deallocate(T* at, std::size_t n) noexcept {
    if (bytes(n) < kPage) return std::allocator<T>().deallocate(at, n);
    give_pages_back(at, bytes(n));
  }
  friend bool operator==(const PageAllocator& /*a*/, const PageAllocator& /*b*/) { return true; }
};

/// What a region's map is made of: on a robot, maps come and go.
template <class T>
using PageVector = std::vector<T, PageAllocator<T>>;

/// Memory that a vector holds.
template <class T>
[[nodiscard]] std::size_t bytes_of(const PageVector<T>& vector) noexcept {
  return PageAllocator<T>::bytes(vector.capacity());
}

}  // namespace vantage
