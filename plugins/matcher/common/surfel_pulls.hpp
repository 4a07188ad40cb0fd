#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/gauss_newton.hpp"
#include "vantage/map_element.hpp"

namespace vantage::matching {

/// A scan point and the surfel nearest to it.
struct SurfelMatch {
  std::uint32_t surfel, point;
};

/// The derivatives of an objective, times a factor, surfel by surfel.
/// @param add  add(match, equations): adds the match's term
template <class Add>
[[nodiscard]] std::vector<Pull> pulls_of(std::vector<SurfelMatch> matches, double factor,
                                         const Add& add) {
  std::ranges::sort(matches, {}, [](const SurfelMatch& m) { return std::pair(m.surfel, m.point); });
  std::vector<Pull> pulls;
  for (std::size_t k = 0; k < matches.size();) {
    const std::uint32_t surfel = matches[k].surfel;
    NormalEquations equations;
    for (; k < matches.size() && matches[k].surfel == surfel; ++k) add(matches[k], equations);
    Pull& pull = pulls.emplace_back();
    pull.element = surfel;
    auto hessian = pull.hessian.begin();
    for (Eigen::Index row = 0; row < 6; ++row) {
      pull.gradient[static_cast<std::size_t>(row)] =
          static_cast<float>(factor * equations.gradient[row]);
      for (Eigen::Index column = row; column < 6; ++column) {
        *hessian++ = static_cast<float>(factor * equations.hessian(row, column));
      }
    }
  }
  return pulls;
}

}  // namespace vantage::matching
