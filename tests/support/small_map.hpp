#pragma once

#include <doctest/doctest.h>

#include <string>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/small_config.hpp"
#include "vantage/io/point_cloud_io.hpp"

namespace vantage::test {

/// A folder with the small square as `map.pcd`, and a configuration over it.
struct SmallMap {
  TemporaryFolder folder;
  std::string config = (folder.path() / "c.toml").string();

  explicit SmallMap(const SmallConfig& content) {
    REQUIRE(io::write_pcd(folder.path() / "map.pcd", small_square(), io::Precision::float32));
    write(content);
  }
  void write(const SmallConfig& content) const { write_text(config, to_text(content)); }
};

}  // namespace vantage::test
