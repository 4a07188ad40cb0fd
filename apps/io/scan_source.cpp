#include "io/scan_source.hpp"

#include <utility>

#include "io/folder_scans.hpp"

namespace vantage::io {

Result<std::unique_ptr<ScanSource>> open_scans(const ScanOptions& options) {
  if (!options.topic.empty()) {
    return fail(ErrorCode::invalid_input,
                "files of single scans have no topics, so none can be chosen",
                SourceLocation{options.path.string(), 0, 0});
  }
  VANTAGE_TRY(auto sequence, ScanSequence::open(options.path, options.rate_hz));
  return folder_scans(std::move(sequence));
}

}  // namespace vantage::io
