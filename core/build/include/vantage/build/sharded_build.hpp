#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "vantage/api.hpp"
#include "vantage/build/build.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

class MapParts;

/// Shard `number` of `count`, from 1 on.
struct Shard {
  std::size_t number = 1, count = 1;
};

/// How a build of a map in parts works.
struct ShardedBuildOptions {
  /// The folder of parts: the plan of the build, and the regions that are finished. It is made if
  /// it does not exist; one that holds anything else is refused. All processes of a build use the
  /// same folder.
  std::filesystem::path parts;
  /// Identifies the content of the map: parts of another map are refused.
  std::uint64_t map_key = 0;
  /// For the points of a block of regions and what is made of them [bytes]. The bundle does not
  /// depend on it, and it may differ between processes.
  std::uint64_t memory = std::uint64_t{4} << 30U;
};

/// What a shard is, and what is left of it to build.
struct ShardStatus {
  std::size_t regions = 0, finished = 0;
  std::uint64_t viewpoints = 0;
  /// The points within reach of its viewpoints, summed over its regions: what the shard costs.
  double points_times_viewpoints = 0;
};

/// What is left of a build, estimated.
struct BuildEstimate {
  std::size_t sampled = 0;  ///< regions that were built to find out
  double core_seconds = 0;  ///< for all regions that are not finished; without the merge
};

/// A build that does not hold the map, runs in one or several processes, and continues where it was
/// stopped. A plan is made first; then the shards are built, in any order and by any processes;
/// then they are merged into the bundle. The bundle has the bytes that a build in memory makes of
/// the same points. Thread safety: one thread.
class ShardedBuild {
 public:
  using Progress = std::function<void(const BuildProgress&)>;

  /// Makes the plan, or reads the one in the folder of parts. While another process makes it, this
  /// one waits. All arguments but the options are borrowed.
  /// Errors: `unsupported` for a plugin or an option that needs the whole map at once;
  /// `already_exists` for a folder that is not one of parts, or that has those of another build: of
  /// another map, another configuration or other versions of the program and its plugins;
  /// `invalid_input` for an empty effective_config, which alone tells builds with other parameters
  /// apart, and for a region that does not fit into the memory, as soon as that is known;
  /// `corrupt_data`; `io_failure`; those of build_region_maps.
  [[nodiscard]] VANTAGE_API static Result<ShardedBuild> open(const MapParts& map,
                                                             PointsView trajectory,
                                                             BuildPlugins& plugins,
                                                             const BuildParams& params,
                                                             ShardedBuildOptions options);
  VANTAGE_API ShardedBuild(ShardedBuild&&) noexcept;
  VANTAGE_API ~ShardedBuild();

  [[nodiscard]] VANTAGE_API const Partition& partition() const noexcept;
  [[nodiscard]] VANTAGE_API std::uint64_t map_points() const noexcept;
  [[nodiscard]] VANTAGE_API std::uint64_t ground_points() const noexcept;
  /// What a process has to be allowed so that every region fits [bytes].
  [[nodiscard]] VANTAGE_API std::uint64_t least_memory() const noexcept;
  /// Errors: `invalid_input` for a shard that does not exist; those of reading the parts.
  [[nodiscard]] VANTAGE_API Result<ShardStatus> status(const Shard& shard) const;

  /// Builds some neighbouring regions that are not finished, without keeping them, and multiplies
  /// what they cost. Errors: those of `build`.
  [[nodiscard]] VANTAGE_API Result<BuildEstimate> estimate() const;

  /// Builds the regions of a shard that no process has finished. They are on the disk when it
  /// returns.
  /// @return  how many regions it built
  /// Errors: `invalid_input` for a shard that does not exist, or for a region that does not fit
  /// into the memory with what decides about it; `already_exists` if another process is seen to
  /// build the shard (where locks do not work, both build it, and no harm is done); those of
  /// build_region_maps.
  [[nodiscard]] VANTAGE_API Result<std::size_t> build(const Shard& shard,
                                                      const Progress& progress = {});

  /// Makes the bundle of all regions and removes the parts; their folder stays if it holds
  /// anything that no build wrote. The report's times are those of this object; those of other
  /// processes are not known. Errors: `not_found` if regions are missing; it says how many. Those
  /// of build_region_maps.
  [[nodiscard]] VANTAGE_API Result<BuildReport> merge(const Progress& progress = {});

 private:
  struct State;
  explicit ShardedBuild(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace vantage
