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
  gauss_newton,  ///< with the majorizer in its place: cheaper steps, more of them
};
constexpr auto enum_names(Optimizer /*unused*/) {
  using namespace std::string_view_literals;
  return std::array{std::pair{"newton"sv, Optimizer::newton},
                    std::pair{"gauss_newton"sv, Optimizer::gauss_newton}};
}

struct NewtonOptions {
  Optimizer optimizer = Optimizer::newton;
  std::size_t stride = 1;  ///< one in so many batches of points stands for all
  std::uint32_t max_iterations = 35;
  double translation_epsilon = 1e-3;  ///< [m]
  double rotation_epsilon = 1e-4;     ///< [rad]
  double max_step_translation = 0.5;  ///< [m]
  double max_step_rotation = 0.1;     ///< [rad]
};

/// What the steps need of the objective.
[[nodiscard]] Extent extent_of(const NewtonOptions& options) noexcept;

struct Minimum {
  Pose T_local_scan;
  Derivatives at;  ///< at that pose
  Termination termination = Termination::max_iterations;
  std::uint32_t iterations = 0;  ///< steps looked for
};

/// Minimizes the objective from a start by Newton's method with a line search.
///
/// Where the Hessian's eigenvalues, in the metric of the majorizer, are below 1/2 (among them all
/// negative ones) they are raised to it: every step leads downhill, and near the minimum, where
/// they are above, it is Newton's own. A step must gain what Armijo's rule asks and is halved until
/// it does. The derivatives are computed once a trial and serve the next step.
/// @param at_start  the derivatives at `start`
[[nodiscard]] Minimum minimize(const Objective& objective, const Pose& start,
                               const Derivatives& at_start, const NewtonOptions& options,
                               Workspace& workspace);

}  // namespace vantage::ndt
