// Compiled with -mavx2 -mfma. For other processors, it is a second copy of the baseline that is
// never called.
#if defined(__AVX2__)
#include "lanes_8.hpp"
#else
#include "lanes_4.hpp"
#endif
#define VANTAGE_NDT_EVALUATE evaluate_avx2
#include "kernel_body.hpp"
