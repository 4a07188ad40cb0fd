#pragma once

#include <span>
#include <vector>

#include "vantage/map_element.hpp"

namespace vantage::view {

/// The degrees of freedom of a pose.
inline constexpr double kFreedom = 6.0;

/// How much each element does to fix the pose of one scan, its leverage: tr(H^-1 H_j), where H_j is
/// the Hessian of its pull and H the sum of them all. The leverages sum up to `kFreedom`; no unit
/// of rotations changes them. An element is negative where the objective curves the other way.
/// Empty if H is not positive definite: the elements do not fix the pose.
/// Source: Hoaglin and Welsch 1978, the leverage of an observation of several rows.
[[nodiscard]] std::vector<double> leverages_of(std::span<const Pull> pulls);

}  // namespace vantage::view
