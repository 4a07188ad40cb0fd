#pragma once

#include <string>
#include <vector>

#include "vantage/evaluation/evaluation.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The comparison as rows of text, header first; a row for each configuration and route, the
/// baselines beneath: for the terminal. The first `kComparisonNames` columns are names.
[[nodiscard]] std::vector<std::vector<std::string>> comparison(const Evaluation& evaluation);
inline constexpr std::size_t kComparisonNames = 3;

/// One page that needs no other file (see report::Page): verdict, tables, figures and maps as in
/// the paper, and beside them what the paper's metric cannot see.
///
/// Every number of a configuration on a route stands in an element with the attributes
/// `data-config`, `data-route`, `data-map` ("observable" for the configuration's own region maps,
/// else the baseline's name), `data-metric`, the path of the number in the run's summary.json
/// ("error_m.mean"), and `data-value`, the number as it is there, in full.
/// Errors: `internal` for a picture that cannot be made.
[[nodiscard]] Result<std::string> to_html(const Evaluation& evaluation);

}  // namespace vantage
