#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "vantage/build/build.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What decides the bytes of regions, each under its name: processes whose identities agree may
/// build regions of one bundle. Paths are no part of it, but what they lead to is:
/// the bytes of libraries and poses, and the names, sizes and times of the files of a recording.
struct BuildIdentity {
  std::vector<std::pair<std::string, std::uint64_t>> parts;

  /// All of it in one number.
  [[nodiscard]] std::uint64_t key() const noexcept;
  friend bool operator==(const BuildIdentity&, const BuildIdentity&) = default;
};

/// @param map_key  identifies the content of the map
/// Errors: `io_failure` for the file of a plugin or of the program that cannot be read.
[[nodiscard]] Result<BuildIdentity> identity_of(std::uint64_t map_key, PointsView trajectory,
                                                const BuildPlugins& plugins,
                                                const BuildParams& params);

/// What `there` has otherwise: "another map and another configuration".
[[nodiscard]] std::string difference(const BuildIdentity& here, const BuildIdentity& there);

}  // namespace vantage
