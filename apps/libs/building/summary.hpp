#pragma once

#include "building/input.hpp"
#include "terminal/command_line.hpp"
#include "vantage/build/build.hpp"
#include "vantage/result.hpp"

namespace vantage::building {

/// Prints what a build made and what it cost, as text or as JSON. Errors: those of reading the
/// bundle's index.
[[nodiscard]] Result<void> print_summary(const BuildReport& report, const Prepared& prepared,
                                         const cli::CommonOptions& options);

}  // namespace vantage::building
