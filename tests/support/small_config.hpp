#pragma once

#include <string>

#include "vantage/point_cloud.hpp"

namespace vantage::test {

/// What small tests build from, as TOML; each text is what stands behind the key or in the section.
struct SmallConfig {
  std::string files = R"(["map.pcd"])";
  std::string partitioner = "uniform_grid", partitioner_params = "cell_width = 5.0";
  std::string viewpoints = "voxel_size = 3.0\n";
  std::string visibility = "plugin = \"keep_all\"\n";
  std::string store = "params = { root = \"bundle\" }\n";  ///< but for the plugin, pcd_tiles
  std::string matcher = "plugin = \"ndt\"\n";
  std::string more{};  ///< further sections
};

/// The whole map of a simulated world in the folder `world`, for a VLP-16.
[[nodiscard]] SmallConfig whole_world();

/// The whole file. Sections that are empty are left out.
[[nodiscard]] std::string to_text(const SmallConfig& config);

/// A level square of 10 m, a point every 25 cm.
[[nodiscard]] PointCloud small_square();

}  // namespace vantage::test
