#pragma once

#include <memory>

#include "vantage/io/scan_source.hpp"

namespace vantage::io {

/// Gives the same scans, but reads the next one in a separate thread while the caller works on the
/// one before. An error comes in its turn, after the scans before it.
[[nodiscard]] std::unique_ptr<ScanSource> read_ahead(std::unique_ptr<ScanSource> source);

}  // namespace vantage::io
