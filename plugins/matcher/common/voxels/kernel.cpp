#include "kernel.hpp"

namespace vantage::ndt::kernel {

bool has_avx2() noexcept {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
#else
  return false;
#endif
}

Evaluate fastest() noexcept { return has_avx2() ? &evaluate_avx2 : &evaluate_baseline; }

}  // namespace vantage::ndt::kernel
