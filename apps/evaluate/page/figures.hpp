#pragma once

#include <string>

#include "vantage/evaluation/evaluation.hpp"

namespace vantage::page {

/// Fig. 10: T_align.
[[nodiscard]] std::string alignment_figures(const Evaluation& evaluation);
/// Fig. 11: S_fitness; coverage, NVTL and error in the same form.
[[nodiscard]] std::string fitness_figures(const Evaluation& evaluation);
/// Fig. 12: LCP, over scans and for each region.
[[nodiscard]] std::string lcp_figures(const Evaluation& evaluation);
[[nodiscard]] std::string error_figures(const Evaluation& evaluation);
/// How well the motion is known before a scan is matched.
[[nodiscard]] std::string motion_figures(const Evaluation& evaluation);
/// The integrity risk along the routes.
[[nodiscard]] std::string risk_figures(const Evaluation& evaluation);

}  // namespace vantage::page
