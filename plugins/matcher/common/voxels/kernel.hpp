#pragma once

#include <cstddef>
#include <cstdint>

#include "block_table.hpp"

// The inner loop, compiled once for every instruction set. Only plain data crosses this interface:
// if a template or an inline function were shared with other files, the copy compiled for AVX2
// could end up running on a processor without AVX2. Lengths are in voxels here: a voxel's edge is
// 1.
namespace vantage::ndt::kernel {

inline constexpr std::size_t kBatch = 8;

/// A Gaussian without its last number, which is stored separately: eight floats are one load.
struct alignas(32) Row {
  float mean[3];             ///< in its voxel, [0, 1)
  float xx, xy, xz, yy, yz;  ///< inverse covariance
};

/// The voxels of a block that, or a face neighbour of which, have a Gaussian or are occupied. Where
/// nothing has a Gaussian, nothing needs to be looked up.
struct Surroundings {
  std::uint64_t gaussians = 0, occupied = 0;
};

/// After the last Gaussian comes one more, so far from everything that it has no weight.
struct Map {
  BlockTable blocks;
  const Row* rows = nullptr;
  const float* zz = nullptr;
  std::uint32_t nothing = 0;  ///< the number of that extra Gaussian
  bool has_bare = false;      ///< some voxels are known to be occupied, but have no Gaussian
  /// Only for maps with bare voxels: of each slot of `blocks`.
  const Surroundings* surroundings = nullptr;
};

/// Kinds of points of a scan in a map with bare voxels: in an occupied voxel, or only beside one.
/// The points of a kind that meet Gaussians stand for all of the kind.
inline constexpr std::size_t kKinds = 2;

/// The voxels that a point is compared with, as steps from its own voxel.
struct Search {
  std::uint32_t size = 0;
  std::int32_t steps[27][3] = {};
  float offsets[27][3] = {};  ///< the same steps as floating point
  bool only_faces = false;    ///< no step goes beyond the voxels that share a face
  bool within_edge = false;   ///< only Gaussians whose mean is nearer than a voxel's edge
};

/// Scan points, and what is kept about their voxels while the points stay in them.
struct alignas(32) Batch {
  float x[kBatch], y[kBatch], z[kBatch];  ///< sensor frame
  std::int32_t voxel[3][kBatch];          ///< kUnknown: not looked up yet
  float found[kBatch];                    ///< how many Gaussians the neighbourhood has
  // Only for maps with bare voxels.
  float compared[kKinds][kBatch];  ///< 1 for a point of this kind that stands for the kind, or 0
  std::int32_t kind[kBatch];       ///< kKinds: in neither
  std::uint32_t used;              ///< bit s: at least one point has a Gaussian at step s
};
inline constexpr std::int32_t kUnknown = INT32_MIN;
/// A point here is in no map, whatever the pose.
inline constexpr float kNowhere = 1e7F;

struct alignas(32) Gaussians {
  std::uint32_t of[kBatch];
};

struct Scan {
  Batch* batches = nullptr;
  Gaussians* neighbours = nullptr;  ///< Search::size for each batch
};

struct Pose {
  float rotation[9];
  float translation[3];   ///< in its voxel, [0, 1)
  std::int32_t voxel[3];  ///< of the sensor
};

struct Coefficients {
  float half_d2 = 0.0F;
  bool best_is_least = false;  ///< d1 > 0: the nearest voxel's likelihood is the smallest
};

/// Sum over points of J^T A J for a symmetric 3x3 A and J = [I, -[y]x], upper triangle by blocks.
struct Quadratic {
  double tt[6], tr[9], rr[6];
};
/// The sums over some batches, without the factors d1 and d2.
struct Sums {
  double value;    ///< sum of exp(...)
  double mean;     ///< of each point's mean over its Gaussians
  double best;     ///< of each point's best
  double matched;  ///< points with at least one Gaussian
  /// Only for maps with bare voxels: points of each kind, those compared, and their `best` and
  /// `mean`.
  double of_kind[kKinds], compared[kKinds], best_of_kind[kKinds], mean_of_kind[kKinds];
  double gradient[3], torque[9];  ///< g and g y^T
  Quadratic positive, negative;
};

enum class Terms : std::uint8_t {
  score,      ///< no derivatives
  majorizer,  ///< without `negative`
  everything,
};

struct Task {
  Map map;
  Search search;
  Scan scan;
  Pose pose;
  Coefficients coefficients;
  Terms terms;
  std::size_t stride = 1;
};

/// Sums up every Task::stride-th of the batches [first, last).
using Evaluate = void (*)(const Task& task, std::size_t first, std::size_t last, Sums& sums);

void evaluate_baseline(const Task& task, std::size_t first, std::size_t last, Sums& sums);
void evaluate_avx2(const Task& task, std::size_t first, std::size_t last, Sums& sums);

/// The fastest one for this processor.
[[nodiscard]] Evaluate fastest() noexcept;
[[nodiscard]] bool has_avx2() noexcept;

}  // namespace vantage::ndt::kernel
