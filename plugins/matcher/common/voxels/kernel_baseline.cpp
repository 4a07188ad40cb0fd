#include "lanes_4.hpp"
#define VANTAGE_NDT_EVALUATE evaluate_baseline
#include "kernel_body.hpp"
