#pragma once

#include <memory>

#include "vantage/io/scan_source.hpp"

namespace vantage::io {

/// The same scans, read by a thread of its own while the caller works on those before: at most two
/// wait at any time. An error comes when its turn has come, after the scans before it.
[[nodiscard]] std::unique_ptr<ScanSource> read_ahead(std::unique_ptr<ScanSource> source);

}  // namespace vantage::io
