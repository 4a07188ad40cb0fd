#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "terminal/input_options.hpp"
#include "vantage/evaluation/evaluation.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The options that say which drives are evaluated: --scans and --reference, once per drive.
struct RouteOptions {
  std::vector<std::filesystem::path> scans, references, odometries;
  std::vector<std::string> topics, reference_topics, odometry_topics, names;
  std::vector<std::string> priors, prior_topics;
  std::string prior_sigma;
  std::filesystem::path map_projector;
  std::string mount;
  std::vector<std::string> imus, imu_topics;
  bool imu_by_frame = false;
  ScanChoice choice;
  double rate_hz = 10.0;

  void add_to(CLI::App& app);
  /// What may be the path of a file that is read.
  [[nodiscard]] std::vector<std::filesystem::path> paths() const;
  /// Errors: usage errors for options that do not fit together; those of InputOptions::open.
  /// @param map_files  see InputOptions::open
  [[nodiscard]] Result<std::vector<NamedInputs>> open(
      std::span<const std::filesystem::path> map_files = {}) const;
};

/// The names of drives without --route: the folders of their scans, or the parent folders if the
/// former would be equal (`route_1/scans`, `route_2/scans`).
/// Error: a usage error if the parent folders are equal, too.
[[nodiscard]] Result<std::vector<std::string>> route_names(
    const std::vector<std::filesystem::path>& scans);

}  // namespace vantage
