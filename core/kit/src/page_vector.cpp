#include "vantage/kit/page_vector.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <new>

namespace vantage {

#ifdef VANTAGE_PAGES_OF_THE_HEAP

void* take_pages(std::size_t bytes) { return ::operator new(bytes); }
void give_pages_back(void* at, std::size_t /*bytes*/) noexcept { ::operator delete(at); }

#else

namespace {

struct Pages {
  std::byte* at = nullptr;
  std::size_t bytes = 0;
};

void unmap(const Pages& block) noexcept {
  if (block.at != nullptr) munmap(block.at, block.bytes);
}

/// Freed blocks, the oldest first. A page that is new from the system costs a fault, which takes
/// longer than all that is done with a page of a map: on a virtual machine 16 us.
class FreedPages {
 public:
  /// The front of the smallest block that is large enough; if none is, the largest block.
  Pages take(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    const auto end = blocks_.begin() + size_;
    const auto best = std::min_element(blocks_.begin(), end, [&](const Pages& a, const Pages& b) {
      const bool a_fits = a.bytes >= bytes;
      if (a_fits != (b.bytes >= bytes)) return a_fits;
      return a_fits ? a.bytes < b.bytes : a.bytes > b.bytes;
    });
    if (best == end) return {};
    const Pages taken{best->at, std::min(best->bytes, bytes)};
    bytes_ -= taken.bytes;
    best->at += taken.bytes;
    best->bytes -= taken.bytes;
    if (best->bytes == 0) {
      std::move(best + 1, end, best);
      --size_;
    }
    return taken;
  }

  void put(const Pages& block) noexcept {
    if (block.bytes > kMost) return unmap(block);
    const std::lock_guard lock(mutex_);
    std::ptrdiff_t gone = 0;
    for (; bytes_ + block.bytes > kMost || size_ - gone == std::ssize(blocks_); ++gone) {
      unmap(blocks_[gone]);
      bytes_ -= blocks_[gone].bytes;
    }
    if (gone > 0) std::move(blocks_.begin() + gone, blocks_.begin() + size_, blocks_.begin());
    size_ -= gone;
    blocks_[size_++] = block;
    bytes_ += block.bytes;
  }

 private:
  static constexpr std::size_t kMost = std::size_t{2} << 20U;
  std::mutex mutex_;
  std::array<Pages, 64> blocks_{};
  std::ptrdiff_t size_ = 0;
  std::size_t bytes_ = 0;
};

constinit FreedPages freed;  // NOLINT(*-avoid-non-const-global-variables): the process's memory

}  // namespace

void* take_pages(std::size_t bytes) {
  const Pages block = freed.take(bytes);
  if (block.bytes == bytes) return block.at;
  void* const at = block.at != nullptr ? mremap(block.at, block.bytes, bytes, MREMAP_MAYMOVE)
                                       : mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                                              MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (at != MAP_FAILED) return at;
  unmap(block);
  throw std::bad_alloc();
}

void give_pages_back(void* at, std::size_t bytes) noexcept {
  freed.put({static_cast<std::byte*>(at), bytes});
}

#endif

}  // namespace vantage
