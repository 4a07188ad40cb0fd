#pragma once

#include <cstddef>
#include <cstdint>

// Vectors of eight, for AVX2.
namespace vantage::ndt::kernel {
namespace {

constexpr std::size_t kLanes = 8;
using Floats = float __attribute__((vector_size(32), may_alias));
using Ints = std::int32_t __attribute__((vector_size(32), may_alias));

struct Columns {
  Floats of[4];
};
/// Columns [from, from + 4) of one row per lane.
inline Columns columns(const float* const (&rows)[kLanes], std::size_t from) {
  using Half = float __attribute__((vector_size(16), may_alias));
  // Rows i and i + 4 in one vector: the following steps treat both halves alike.
  const auto pair = [&](std::size_t lane) {
    const Half low = *reinterpret_cast<const Half*>(rows[lane] + from);
    const Half high = *reinterpret_cast<const Half*>(rows[lane + 4] + from);
    return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
  };
  const Floats r0 = pair(0), r1 = pair(1), r2 = pair(2), r3 = pair(3);
  const Floats a = __builtin_shufflevector(r0, r1, 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats b = __builtin_shufflevector(r0, r1, 2, 10, 3, 11, 6, 14, 7, 15);
  const Floats c = __builtin_shufflevector(r2, r3, 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats d = __builtin_shufflevector(r2, r3, 2, 10, 3, 11, 6, 14, 7, 15);
  return {{__builtin_shufflevector(a, c, 0, 1, 8, 9, 4, 5, 12, 13),
           __builtin_shufflevector(a, c, 2, 3, 10, 11, 6, 7, 14, 15),
           __builtin_shufflevector(b, d, 0, 1, 8, 9, 4, 5, 12, 13),
           __builtin_shufflevector(b, d, 2, 3, 10, 11, 6, 7, 14, 15)}};
}

}  // namespace
}  // namespace vantage::ndt::kernel
