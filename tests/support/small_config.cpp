#include "support/small_config.hpp"

namespace vantage::test {

std::string to_text(const SmallConfig& config) {
  const auto section = [](const std::string& name, const std::string& content) {
    return content.empty() ? std::string() : "[" + name + "]\n" + content;
  };
  return "schema = 1\n" + section("map", "files = " + config.files + "\n") +
         section("partitioner", "plugin = \"" + config.partitioner + "\"\nparams = { " +
                                    config.partitioner_params + " }\n") +
         section("ground", "plugin = \"pmf\"\n") + section("viewpoints", config.viewpoints) +
         section("visibility", config.visibility) +
         section("store",
                 "plugin = \"pcd_tiles\"\n" + (config.store.find("content") == std::string::npos
                                                   ? "content = \"points\"\n" + config.store
                                                   : config.store)) +
         section("matcher", config.matcher) + config.more;
}

SmallConfig whole_world() {
  return {.files = R"(["world/map.pcd"])",
          .partitioner = "whole_map",
          .partitioner_params = "",
          .viewpoints = "voxel_size = 5.0\nsensor_height = 1.0\n",
          .visibility = "plugin = \"keep_all\"\nmax_range = 100.0\n",
          .store = "content = \"prepared\"\nparams = { root = \"maps\" }\n"};
}

PointCloud small_square() {
  PointCloud map;
  for (int x = 0; x < 40; ++x) {
    for (int y = 0; y < 40; ++y) map.emplace_back(0.25 * x, 0.25 * y, 0.0);
  }
  return map;
}

}  // namespace vantage::test
