#pragma once

#include <malloc.h>

namespace vantage::cli {

/// What becomes of freed memory in a program that localizes. Region maps come and go, and glibc
/// alone would keep most of them: blocks of 4 MiB or more go back to the system at once. Smaller
/// ones, such as a scan's buffers, are used again by the next scan; at most 2 MiB of them wait for
/// it. One arena serves all threads, so that this holds for all of them together. Without that, the
/// system clears the same pages for every scan.
inline void keep_only_scan_buffers() {
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  mallopt(M_TRIM_THRESHOLD, 2 << 20);
}

}  // namespace vantage::cli
