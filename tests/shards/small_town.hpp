#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::test {

/// What differs between the builds of a town; each text is what stands in the section.
struct TownConfig {
  std::string partitioner = "plugin = \"uniform_grid\"\nparams = { cell_width = 20.0 }";
  std::string ground = "plugin = \"pmf\"\nparams = { max_window = 5.0 }";
  std::string viewpoints = "voxel_size = 8.0";
  std::string visibility =
      "plugin = \"surface\"\nmax_range = 15.0\nparams = { point_spacing = 0.4 }";
  std::string store = "plugin = \"pcd_tiles\"";
  std::string more = {};
};

/// A sloping ground with houses, 120 x 70 m, in memory no larger than 6 MiB: as a file that is not
/// in any order, and as a tiled map.
class SmallTown {
 public:
  SmallTown();

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_.path() / name).string();
  }
  /// Writes a configuration; the map is tiled.
  /// @return  the path of the file
  [[nodiscard]] std::string config(const TownConfig& config) const;

 private:
  TemporaryFolder folder_;
};

/// The files of a bundle and their bytes. The index names the map's files, so all builds that are
/// compared must have the same [map].
[[nodiscard]] std::map<std::string, std::string> bytes_of(const std::filesystem::path& folder);

/// The variables that give a program a disk which cannot do everything; see failing_disk.cpp.
[[nodiscard]] std::vector<std::string> failing_disk(const std::string& words,
                                                    const std::string& log = {});

/// Runs a program, and requires that it succeeds.
void must_run(const std::string& program, const std::vector<std::string>& arguments);

}  // namespace vantage::test
