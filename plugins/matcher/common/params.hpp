#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>

#include "common/kernel.hpp"
#include "common/point_tree.hpp"
#include "common/step_params.hpp"
#include "vantage/params.hpp"

namespace vantage::matching {

/// The parameters that icp and gicp share. A plugin's Params derive from this struct; their schema
/// begins with their own fields.
struct MatchingParams : StepParams {
  double map_voxel = 0.25;
  std::uint32_t neighbours = 10;
  double sigma = 0.05;
  double max_distance = 1.0;
  std::optional<double> final_distance;
  Kernel kernel = Kernel::geman_mcclure;
  double kernel_scale = 3.0;

  /// @tparam Params  the struct that derives from this one
  template <class Params>
  [[nodiscard]] static constexpr auto fields() {
    const auto of = []<class T>(T MatchingParams::*member) -> T Params::* { return member; };
    // Not constexpr: clang 14 does not take the lambda for a constant in a template.
    const std::tuple own{
        optional("map_voxel", of(&MatchingParams::map_voxel), "m",
                 "the map is thinned to one centroid per voxel of this edge; 0: no thinning",
                 non_negative),
        optional("neighbours", of(&MatchingParams::neighbours), "points",
                 "points from which the normal at a point is computed",
                 between(3, PointTree::kMostNeighbours)),
        optional("sigma", of(&MatchingParams::sigma), "m",
                 "standard deviation of a point across its surface", positive),
        optional("max_distance", of(&MatchingParams::max_distance), "m",
                 "a scan point farther than this from all map points has no match", positive),
        optional("final_distance", of(&MatchingParams::final_distance), "m",
                 "max_distance is halved at each step down to this; it stays fixed if left out",
                 positive),
        optional("kernel", of(&MatchingParams::kernel), "",
                 "robust loss of a squared normalized residual", Source{{}, "Babin et al. 2019"}),
        optional("kernel_scale", of(&MatchingParams::kernel_scale), "",
                 "residual at which the loss turns, in standard deviations", positive)};
    return std::tuple_cat(
        own, step_fields<Params>(
                 {.max_iterations = "limit of Gauss-Newton steps",
                  .min_matches =
                      "minimum number of scan points with a match; with fewer, matching fails",
                  .min_coverage =
                      "minimum share of scan points with a match; with less, matching fails"}));
  }

  [[nodiscard]] Result<void> validate() const {
    if (final_distance && *final_distance > max_distance) {
      return fail_at({"final_distance", "max_distance"},
                     "final_distance must not be larger than max_distance (" +
                         std::to_string(max_distance) + " m)");
    }
    return {};
  }

  [[nodiscard]] RobustLoss loss() const noexcept {
    return {.kernel = kernel, .scale = kernel_scale};
  }

  /// The distance within which matches are searched for after a number of steps [m].
  [[nodiscard]] double distance_after(std::uint32_t steps) const noexcept {
    return std::max(final_distance.value_or(max_distance),
                    std::ldexp(max_distance, -static_cast<int>(std::min(steps, 1000U))));
  }
  /// The number of steps after which this distance stays the same.
  [[nodiscard]] std::uint32_t settled() const noexcept {
    std::uint32_t steps = 0;
    while (distance_after(steps) > final_distance.value_or(max_distance)) ++steps;
    return steps;
  }
};

}  // namespace vantage::matching
