#pragma once

#include <memory>

#include "io/scan_sequence.hpp"
#include "vantage/io/scan_source.hpp"

namespace vantage::io {

/// The files of a sequence as a source. The stamps of a sequence increase, so no scan is ever left
/// out.
[[nodiscard]] std::unique_ptr<ScanSource> folder_scans(ScanSequence sequence);

}  // namespace vantage::io
