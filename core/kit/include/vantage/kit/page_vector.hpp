#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <memory>
#include <new>
#include <vector>

namespace vantage {

/// Allocates blocks of 4 KiB or more as pages of their own. They go back to the system as soon as
/// they are freed, whereas a heap on which large blocks come and go keeps the holes between them.
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
    void* const pages =
        mmap(nullptr, bytes(n), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (pages == MAP_FAILED) throw std::bad_alloc();
    return static_cast<T*>(pages);
  }
  void deallocate(T* at, std::size_t n) noexcept {
    if (bytes(n) < kPage) return std::allocator<T>().deallocate(at, n);
    munmap(at, bytes(n));
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
