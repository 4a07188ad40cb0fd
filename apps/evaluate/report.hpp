#pragma once

#include <string>
#include <vector>

#include "vantage/evaluation/evaluation.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The comparison as rows of text for the terminal, header first. There is one row per
/// configuration and route, and the rows of the opponents below it. The first `kComparisonNames`
/// columns are names.
[[nodiscard]] std::vector<std::vector<std::string>> comparison(const Evaluation& evaluation);
inline constexpr std::size_t kComparisonNames = 3;

/// One page that needs no other file (see report::Page): verdict, tables, figures and maps as in
/// the paper, and beside them what the paper's metric cannot see.
///
/// Every number of a configuration on a route stands in an element with the attributes
/// `data-config`; `data-route`; `data-map` ("observable" for the configuration's own region maps,
/// otherwise the opponent's name); `data-metric`, the path of the number in the run's summary.json
/// ("error_m.mean"); and `data-value`, the number in summary.json with all its digits.
/// Errors: `internal` for a picture that cannot be made.
[[nodiscard]] Result<std::string> to_html(const Evaluation& evaluation);

}  // namespace vantage
