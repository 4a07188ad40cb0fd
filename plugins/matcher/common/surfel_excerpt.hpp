#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/surfel_map.hpp"
#include "vantage/result.hpp"
#include "voxel_map.hpp"

namespace vantage::matching {

/// Some surfels of a map as bytes, about 7 bytes each; icp's README.md describes the format.
/// @param which  ascending indices
/// Errors: `invalid_input` for surfels more than a million metres from their middle.
[[nodiscard]] Result<std::vector<std::byte>> encode(const SurfelMap& map,
                                                    const SurfelMap::Options& options,
                                                    std::span<const std::uint32_t> which);

/// The same, but only some of the surfels are kept, in about 6 bytes each; of the others it remains
/// in which cubes of a metre they lie, in about 3 bits a cube.
/// @param which  ascending indices
/// @param kept   some of them, ascending
[[nodiscard]] Result<std::vector<std::byte>> encode_some(const SurfelMap& map,
                                                         const SurfelMap::Options& options,
                                                         std::span<const std::uint32_t> which,
                                                         std::span<const std::uint32_t> kept);

/// What was stored of a map.
struct StoredSurfels {
  SurfelMap map;
  /// If only some surfels were kept: the cubes of a metre that have any, all bare, in the frame of
  /// the map's points.
  std::optional<ndt::VoxelMap> occupied;
};

/// The surfels that `encode` or `encode_some` was given, up to rounding: positions are off by at
/// most 2^-13 m (`encode_some`: 2^-11 m) an axis, normals by 0.2 degrees.
/// Errors: `corrupt_data` for bytes that they do not make; `invalid_input` if the options differ
/// from `wanted`; `too_few_matches` for no surfels.
[[nodiscard]] Result<StoredSurfels> decode(std::span<const std::byte> bytes,
                                           const SurfelMap::Options& wanted);

/// A direction in two numbers of kNormalBits: the octahedron (Meyer et al. 2010), of which only the
/// upper half is needed, because both signs of a normal are the same plane.
inline constexpr unsigned kNormalBits = 9;
using NormalCode = std::array<std::uint32_t, 2>;
/// @param normal  of unit length, or zero
[[nodiscard]] NormalCode code_of(Eigen::Vector3d normal) noexcept;
/// @return  nothing for numbers that `code_of` does not make
[[nodiscard]] std::optional<Eigen::Vector3d> normal_of(const NormalCode& code) noexcept;

}  // namespace vantage::matching
