#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "checks/note.hpp"
#include "vantage/evaluation/column_spool.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/summary.hpp"
#include "vantage/region_directory.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What a page says of a run besides its scans.
struct RunFacts {
  const RunInfo& run;
  const RunSummary& summary;
  std::vector<std::string> remarks;     ///< a sentence each, as text
  std::span<const checks::Note> notes;  ///< what is suspicious
  const RegionDirectory& regions;       ///< of the bundle
  double max_risk;                      ///< of the localizer
  bool reference = false;               ///< the run had one
};

/// Makes a page of a run that needs no other file (see report::Page), scan by scan. Most of what it
/// keeps of the scans is in a ColumnSpool, so its memory hardly grows with the run.
///
/// The page says nothing of a reference. Its counts stand in elements with the attributes
/// `data-metric`, a path in summary.json ("scans.lost"), and `data-value`.
class RunPage {
 public:
  /// @param folder  see ColumnSpool
  explicit RunPage(const std::filesystem::path& folder);

  /// Errors: those of ColumnSpool.
  [[nodiscard]] Result<void> add(const RunScan& scan);
  /// Precondition: a scan was added. Errors: those of ColumnSpool and RegionDirectory.
  [[nodiscard]] Result<std::string> html(const RunFacts& facts) const;

 private:
  ColumnSpool values_;
  Odometer odometer_;
  std::optional<double> first_stamp_;           // [s]
  std::map<std::string, std::size_t> reasons_;  // why scans were not tracked, without numbers
};

}  // namespace vantage
