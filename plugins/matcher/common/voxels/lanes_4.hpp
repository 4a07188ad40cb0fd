#pragma once

#include <cstddef>
#include <cstdint>

// Vectors of four, which every 64-bit processor has.
namespace vantage::ndt::kernel {
namespace {

constexpr std::size_t kLanes = 4;
using Floats = float __attribute__((vector_size(16), may_alias));
using Ints = std::int32_t __attribute__((vector_size(16), may_alias));

struct Columns {
  Floats of[4];
};
/// Columns [from, from + 4) of one row per lane.
inline Columns columns(const float* const (&rows)[kLanes], std::size_t from) {
  const auto row = [&](std::size_t lane) {
    return *reinterpret_cast<const Floats*>(rows[lane] + from);
  };
  const Floats a = __builtin_shufflevector(row(0), row(1), 0, 4, 1, 5);
  const Floats b = __builtin_shufflevector(row(0), row(1), 2, 6, 3, 7);
  const Floats c = __builtin_shufflevector(row(2), row(3), 0, 4, 1, 5);
  const Floats d = __builtin_shufflevector(row(2), row(3), 2, 6, 3, 7);
  return {{__builtin_shufflevector(a, c, 0, 1, 4, 5), __builtin_shufflevector(a, c, 2, 3, 6, 7),
           __builtin_shufflevector(b, d, 0, 1, 4, 5), __builtin_shufflevector(b, d, 2, 3, 6, 7)}};
}

}  // namespace
}  // namespace vantage::ndt::kernel
