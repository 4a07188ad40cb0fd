#pragma once

#include <memory>

#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// A recording that was opened to look at it and is handed on to whoever reads it: to open a large
/// bag without an index reads all of it. Copies are of the same recording.
/// Thread safety: `take` may run on copies of one object from many threads at once.
class OpenedScans {
 public:
  /// Errors: those of open_scans.
  [[nodiscard]] static Result<OpenedScans> open(const ScanOptions& options);

  [[nodiscard]] const ScanOptions& options() const noexcept;
  [[nodiscard]] const ScanDescription& describe() const noexcept;
  /// At the first scan: the source that was opened, or, if it was taken before, one that is opened
  /// now. Errors: those of open_scans.
  [[nodiscard]] Result<std::unique_ptr<ScanSource>> take() const;

 private:
  struct State;
  explicit OpenedScans(std::shared_ptr<State> state) noexcept;
  std::shared_ptr<State> state_;
};

}  // namespace vantage::io
