#pragma once

#include <string>
#include <vector>

namespace vantage::test::seeds {

// Sound inputs of bundle_targets.hpp.
[[nodiscard]] std::vector<std::string> bundle_index();
[[nodiscard]] std::vector<std::string> bundle_regions();
[[nodiscard]] std::vector<std::string> build_plan();
[[nodiscard]] std::vector<std::string> build_parts();
[[nodiscard]] std::vector<std::string> tiled_map();
[[nodiscard]] std::vector<std::string> shared_region();
[[nodiscard]] std::vector<std::string> pcd_region();

}  // namespace vantage::test::seeds
