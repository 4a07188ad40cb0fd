#pragma once

#include <string>
#include <vector>

#include "io/trajectory_io.hpp"
#include "localize/run.hpp"

namespace vantage {

/// One configuration's run with its numbers.
struct EvaluatedRun {
  std::string name;  ///< of the configuration file, without folder and suffix
  Run run;
  RunSummary summary;
  cli::Statistics region_points;  ///< over the bundle's regions (Table 1)
  std::uint64_t bundle_bytes = 0;

  /// Share of the wide-area map's points that the mean region map does without.
  [[nodiscard]] double reduction() const;
};

/// The comparison as rows of text, header first: the same for terminal and page.
[[nodiscard]] std::vector<std::vector<std::string>> comparison(
    const std::vector<EvaluatedRun>& runs);

/// One page that needs nothing but itself: the comparison, each trajectory over its regions
/// coloured by error, and the error of every scan.
[[nodiscard]] std::string to_html(const std::vector<EvaluatedRun>& runs,
                                  const io::Trajectory& reference);

}  // namespace vantage
