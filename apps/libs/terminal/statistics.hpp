#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <span>

namespace vantage::cli {

/// A sample in six numbers; all zero for an empty one. Percentiles are linear between neighbours.
struct Statistics {
  std::size_t count = 0;
  double mean = 0, rmse = 0, std = 0, min = 0, median = 0, p95 = 0, p99 = 0, max = 0;
};

[[nodiscard]] Statistics statistics_of(std::span<const double> sample);
[[nodiscard]] nlohmann::ordered_json to_json(const Statistics& statistics);

}  // namespace vantage::cli
