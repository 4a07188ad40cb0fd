#pragma once

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <algorithm>
#include <cstddef>

namespace vantage::matching {

/// Divides [0, size) into chunks and calls `work(chunk, begin, end)` for each, on as many threads
/// as TBB may use here. The chunks depend only on `size` and `chunk_size`. Results that are kept by
/// chunk and added up in chunk order are therefore the same for any number of threads.
template <class Work>
void for_each_chunk(std::size_t size, std::size_t chunk_size, const Work& work) {
  const std::size_t chunks = (size + chunk_size - 1) / chunk_size;
  const auto run = [&](std::size_t chunk) {
    work(chunk, chunk * chunk_size, std::min(size, (chunk + 1) * chunk_size));
  };
  using tbb::global_control;
  if (chunks < 2 || global_control::active_value(global_control::max_allowed_parallelism) < 2 ||
      tbb::this_task_arena::max_concurrency() < 2) {
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) run(chunk);
  } else {
    tbb::parallel_for(std::size_t{0}, chunks, run);
  }
}

}  // namespace vantage::matching
