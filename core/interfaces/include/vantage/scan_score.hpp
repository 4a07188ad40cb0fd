#pragma once

namespace vantage {

/// How well a scan fits a map at one pose. S_fitness alone rewards a map with missing points (a
/// scan point without a voxel scores 0, a badly matched one below 0), so read it together with
/// coverage and NVTL.
struct ScanScore {
  double fitness = 0.0;  ///< S_fitness, Eq. 12: mean over all N points of the mean over N_i
  double nvtl = 0.0;  ///< nearest voxel transformation likelihood: mean over the matched points of
                      ///< the best voxel's likelihood
  double coverage = 0.0;  ///< share of scan points with at least one voxel, in [0, 1]
  /// Of those points, the share that was compared with the map. The rest met voxels of which a
  /// selector kept only that they are occupied: their part of the score is estimated.
  double compared = 1.0;
};

}  // namespace vantage
