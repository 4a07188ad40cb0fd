#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "simulate/params.hpp"
#include "simulate/world.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::simulation {

/// Called with how much is done; never by two threads at once.
using ProgressFunction = std::function<void(std::size_t done, std::size_t total)>;

/// The wide-area map: every surface that is outside all solids and above the ground, including
/// roofs, whether or not a sensor could ever see it.
///
/// Jittered stratified sampling: one random point in each cell of a grid of `point_spacing` on
/// every plane face (for the ground: in plan view), so that density is even and proportional to
/// area. Noise is normally distributed along the surface's normal, cut off at three standard
/// deviations.
/// @return  points in the map frame [m]: the ground in rows along x from low to high y, then the
///          solids and the leaves in the order of the campus, then what moving vehicles left; the
///          same for any number of threads
[[nodiscard]] PointCloud sample_map(const World& world, const MapParams& params, std::uint64_t seed,
                                    const ProgressFunction& progress = {});

/// The same points in the same order, piece by piece: a few pieces are in memory at a time.
/// @param take  called from one thread at a time; an error ends the sampling
[[nodiscard]] Result<void> stream_map(const World& world, const MapParams& params,
                                      std::uint64_t seed,
                                      const std::function<Result<void>(PointCloud&&)>& take,
                                      const ProgressFunction& progress = {});

}  // namespace vantage::simulation
