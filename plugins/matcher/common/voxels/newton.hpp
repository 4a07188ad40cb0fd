#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include "objective.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage::ndt {

enum class Optimizer : std::uint8_t {
  newton,        ///< with the Hessian
  gauss_newton,  ///< with the majorizer instead of the Hessian: cheaper steps, but more of them
};
constexpr auto enum_names(Optimizer /*unused*/) {
  using namespace std::string_view_literals;
  return std::array{std::pair{"newton"sv, Optimizer::newton},
                    std::pair{"gauss_newton"sv, Optimizer::gauss_newton}};
}

struct NewtonOptions : matching::StepOptions {
  Optimizer optimizer = Optimizer::newton;
  std::size_t stride = 1;  ///< one in so many batches of points stands for all
};

/// What the steps need from the objective.
[[nodiscard]] Extent extent_of(const NewtonOptions& options) noexcept;

struct Minimum {
  Pose T_local_scan;
  Derivatives at;  ///< at that pose
  Termination termination = Termination::max_iterations;
  std::uint32_t iterations = 0;  ///< steps that were computed
};

/// Minimizes the objective from a start by Newton's method with a line search.
///
/// In the metric of the majorizer, eigenvalues of the Hessian below 1/2 (among them all negative
/// ones) are raised to 1/2, so every step leads downhill. Near the minimum all eigenvalues are
/// above 1/2, and the step is Newton's own. A step must satisfy Armijo's rule and is halved until
/// it does. The derivatives are computed once per trial and serve the next step.
/// @param at_start  the derivatives at `start`
[[nodiscard]] Minimum minimize(const Objective& objective, const Pose& start,
                               const Derivatives& at_start, const NewtonOptions& options,
                               Workspace& workspace);

}  // namespace vantage::ndt
