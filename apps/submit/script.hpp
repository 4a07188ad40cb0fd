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
  std::size_t threads = 1;         ///< of a shard
  std::size_t at_once = 0;         ///< shards, on this machine; 0: as many as there are cores for
  std::uint64_t memory = 0;        ///< of a shard [bytes]
  std::filesystem::path programs;  ///< the folder of vantage-build and vantage-merge
  std::vector<std::string> arguments;  ///< of both: configuration and options
  std::filesystem::path folder;        ///< where the programs run
  std::filesystem::path parts;         ///< where logs go
};

/// A script for /bin/sh that runs all shards and then merges. It ends with the status of what it
/// runs.
[[nodiscard]] std::string script_of(const Job& job);

/// A word that the shell reads as this text.
[[nodiscard]] std::string quoted(const std::string& text);

}  // namespace vantage
