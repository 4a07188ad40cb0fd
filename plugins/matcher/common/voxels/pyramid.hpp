#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "newton.hpp"
#include "objective.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/scan_score.hpp"

namespace vantage::ndt {

/// A scan's pose after some steps.
struct Start {
  Pose T_local_scan;
  std::uint32_t iterations = 0;  ///< spent on it
};

/// A map in voxels of 2, 4, 8, ... times the edge, to come nearer to the right pose from a guess
/// that is farther off than a voxel: the basin of convergence is as wide as the voxels are.
///
/// Each level is merged from the next finer one, so a restored map has the levels of the map that
/// was stored. They are made when they are first needed: tracking needs none.
/// Thread safety: const functions may run on one object from many threads at once.
class Pyramid {
 public:
  /// Scratch memory of one alignment at a time; it grows to fit, and then an alignment allocates
  /// nothing.
  struct Workspace {
    PointCloud part;  // of the scan
    std::vector<ndt::Workspace> levels;
  };

  /// @param coefficients  of each coarse level, the finest of them first
  explicit Pyramid(std::vector<NdtCoefficients> coefficients)
      : coefficients_(std::move(coefficients)) {}

  [[nodiscard]] bool empty() const noexcept { return coefficients_.empty(); }
  /// Memory that the levels hold; 0 before they are needed.
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

  /// Minimizes on each level, the coarsest first, with an evenly spaced part of the scan's points;
  /// each level starts where the last ended. A level in which too few points have a voxel is left
  /// out.
  /// @param finest   the map; the same one in each call
  /// @param guess    relative to the origin of `finest`
  /// @param options  of the finest level; the levels together take a part of its iterations
  [[nodiscard]] Start nearer(const VoxelMap& finest, PointsView scan, const Pose& guess,
                             const NewtonOptions& options, Workspace& workspace) const;

 private:
  struct Level {
    Objective objective;
    Eigen::Vector3d shift;  // from its origin to that of the finest map [m]
  };
  [[nodiscard]] const std::vector<Level>& levels_of(const VoxelMap& finest) const;

  std::vector<NdtCoefficients> coefficients_;
  mutable std::once_flag made_;
  mutable std::vector<Level> levels_;  // the coarsest first
  mutable std::atomic<std::size_t> bytes_ = 0;
};

}  // namespace vantage::ndt
