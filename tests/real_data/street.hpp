#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "support/real_data.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/evaluation/summary.hpp"

namespace vantage::test {

/// How the region maps of the recorded street are built.
struct StreetOptions {
  Point shift = Point::Zero();  ///< of the street as a whole
  bool without_ground = false;
  std::vector<std::string> overrides = {};
};

/// The recorded street and region maps of it, in a temporary folder. What fails ends the test case.
class Street {
 public:
  /// @param data    the folder of the recorded street
  /// @param config  name of a file in configs/kitti_street/
  Street(const std::filesystem::path& data, const std::string& config,
         const StreetOptions& options = {});

  /// Its scans or others of the same street, with its reference.
  [[nodiscard]] RunInputs inputs(const std::filesystem::path& scans) const;
  [[nodiscard]] Run localize(const RunInputs& inputs) const;
  [[nodiscard]] Run localize() const { return localize(inputs(data_ / "scans")); }

 private:
  std::filesystem::path data_;
  Point shift_;
  TemporaryFolder folder_;
  Config config_;
  PluginLoader loader_;
};

}  // namespace vantage::test
