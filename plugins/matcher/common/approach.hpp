#pragma once

#include <cstddef>
#include <mutex>
#include <optional>

#include "common/ndt_coefficients.hpp"
#include "common/steps.hpp"
#include "common/surfel_map.hpp"
#include "pyramid.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::matching {

/// The way to a pose from a guess that is far off, for a matcher that needs a near one: ndt's
/// objective in voxels of 8, 4 and 2 m.
///
/// The voxels are made when they are first needed: tracking needs none.
/// Thread safety: const functions may run on one object from many threads at once.
class Approach {
 public:
  using Workspace = ndt::Pyramid::Workspace;

  /// Errors: those of NdtCoefficients::derive.
  [[nodiscard]] static Result<std::vector<NdtCoefficients>> coefficients();

  /// @param edge      of the voxels that the map was thinned to [m]; 0: it was not
  /// @param occupied  the voxels to merge the coarse ones from, if the map's points do not show
  ///                  them all
  Approach(std::vector<NdtCoefficients> coefficients, double edge,
           std::optional<ndt::VoxelMap> occupied = std::nullopt)
      : pyramid_(std::move(coefficients)),
        edge_(edge),
        is_given_(occupied.has_value()),
        finest_(std::move(occupied)) {}

  /// @param map    the same one in each call. It does not count if voxels were given
  /// @param guess  relative to the map's origin; it is returned if the map is too sparse for voxels
  [[nodiscard]] ndt::Start nearer(const SurfelMap& map, PointsView scan, const Pose& guess,
                                  const StepOptions& options, Workspace& workspace) const;

  /// Memory that the voxels hold; 0 before they are needed.
  [[nodiscard]] std::size_t bytes() const noexcept {
    const std::size_t coarse = pyramid_.bytes();
    return coarse == 0 && !is_given_ ? 0 : coarse + finest_->bytes();
  }

  /// The voxels that were given; null if none were.
  [[nodiscard]] const ndt::VoxelMap* occupied() const noexcept {
    return is_given_ ? &*finest_ : nullptr;
  }

 private:
  ndt::Pyramid pyramid_;
  double edge_;
  bool is_given_;
  mutable std::once_flag made_;
  mutable std::optional<ndt::VoxelMap> finest_;
};

}  // namespace vantage::matching
