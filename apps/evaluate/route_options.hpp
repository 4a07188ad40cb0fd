#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "vantage/evaluation/evaluation.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The options that say which drives are evaluated: --scans and --reference once for each.
struct RouteOptions {
  std::vector<std::filesystem::path> scans, references, odometries;
  std::vector<std::string> topics, reference_topics, odometry_topics, names;
  std::string mount;
  double rate_hz = 10.0;

  void add_to(CLI::App& app);
  /// Errors: usage errors for options that do not go together; those of InputOptions::open.
  [[nodiscard]] Result<std::vector<NamedInputs>> open() const;
};

/// What drives are called if nobody says: their scans' folders, or the folders that these are in
/// where the first would not tell them apart (`route_1/scans`, `route_2/scans`).
/// Error: a usage error if those do not either.
[[nodiscard]] Result<std::vector<std::string>> route_names(
    const std::vector<std::filesystem::path>& scans);

}  // namespace vantage
