#pragma once

#include <memory>

#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// A recording that is opened once, described, and then passed on to its reader. This saves time:
/// opening a large bag without an index reads the whole bag. Copies share the recording.
/// Thread safety: `take` may run on copies of one object from many threads at once.
class OpenedScans {
 public:
  /// Errors: those of open_scans.
  [[nodiscard]] static Result<OpenedScans> open(const ScanOptions& options);

  [[nodiscard]] const ScanOptions& options() const noexcept;
  [[nodiscard]] const ScanDescription& describe() const noexcept;
  /// A source that starts at the first scan. The first call returns the source that is already
  /// open; later calls open a new one. Errors: those of open_scans.
  [[nodiscard]] Result<std::unique_ptr<ScanSource>> take() const;

 private:
  struct State;
  explicit OpenedScans(std::shared_ptr<State> state) noexcept;
  std::shared_ptr<State> state_;
};

}  // namespace vantage::io
