#pragma once

#include <string>

#include "vantage/evaluation/comparison.hpp"

namespace vantage {

/// One page that needs no other file.
[[nodiscard]] std::string to_html(const Comparison& comparison);

}  // namespace vantage
