#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

/// What runs the shards.
enum class Engine : std::uint8_t {
  parallel,  ///< GNU parallel
  slurm,
};

/// What a script is made of.
struct Job {
  Engine engine = Engine::parallel;
  std::size_t shards = 1;
  std::size_t threads = 1;             ///< of a shard
  std::size_t at_once = 1;             ///< shards; with parallel, on this machine
  std::uint64_t memory = 0;            ///< of a shard [bytes]
  std::uint64_t merge_memory = 0;      ///< of the merge [bytes]
  std::filesystem::path programs;      ///< the folder of vantage-build and vantage-merge
  std::vector<std::string> arguments;  ///< of both: configuration and options
  std::filesystem::path folder;        ///< where the programs run
  std::filesystem::path own;           ///< of the script and what it leaves; marked by kMarker
};

/// The files in Job::own.
inline constexpr const char* kMarker = ".vantage-submit";
inline constexpr const char* kScript = "submit.sh";

/// A script for /bin/sh that runs all shards, merges, and removes its own files. It ends with the
/// status of what it runs. Only the folder of parts tells what is finished: the script runs every
/// shard each time, and a shard without work ends at once.
[[nodiscard]] std::string script_of(const Job& job);

}  // namespace vantage
