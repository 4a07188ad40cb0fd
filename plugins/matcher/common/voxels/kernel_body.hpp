// The body of the kernel. One file for each instruction set includes it after its lanes_*.hpp, and
// defines the function's name. Everything else is local to that file.
#include "kernel.hpp"

namespace vantage::ndt::kernel {
namespace {

inline Floats floats(float x) { return Floats{} + x; }
inline Ints ints(std::int32_t x) { return Ints{} + x; }
inline Floats load(const float* from) { return *reinterpret_cast<const Floats*>(from); }
inline Ints load(const std::int32_t* from) { return *reinterpret_cast<const Ints*>(from); }
inline void store(float* to, Floats x) { *reinterpret_cast<Floats*>(to) = x; }
inline void store(std::int32_t* to, Ints x) { *reinterpret_cast<Ints*>(to) = x; }
inline bool any(Ints mask) {
  using Words = std::uint64_t __attribute__((vector_size(sizeof(Ints)), may_alias));
  const Words words = reinterpret_cast<Words>(mask);
  std::uint64_t set = 0;
  for (std::size_t word = 0; word < sizeof(Ints) / sizeof(set); ++word) set |= words[word];
  return set != 0;
}
/// x where the mask is set, 0 elsewhere.
inline Floats masked(Ints mask, Floats x) {
  return reinterpret_cast<Floats>(mask & reinterpret_cast<Ints>(x));
}
inline Floats larger(Floats a, Floats b) { return a > b ? a : b; }

inline double sum_of(Floats x) {
  double sum = 0.0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) sum += static_cast<double>(x[lane]);
  return sum;
}

/// exp for x <= 0 to a relative 3e-7; 0 below exp(-40).
inline Floats exp_of(Floats x) {
  const Floats z = x * floats(1.44269504F);
  const Ints kept = z > floats(-58.0F);
  const Floats clamped = larger(z, floats(-58.0F));
  // Rounds to nearest: adding 1.5 * 2^23 leaves the integer in the low bits.
  const Floats shifted = clamped + floats(12582912.0F);
  const Floats f = clamped - (shifted - floats(12582912.0F));
  const Ints exponent = (reinterpret_cast<Ints>(shifted) << 23) + ints(127 << 23);
  // sum of (ln 2)^k f^k / k!, in pairs: a chain of four instead of seven
  const Floats f2 = f * f;
  const Floats p4 =
      floats(1.54035304e-4F) * f2 + (floats(1.33335581e-3F) * f + floats(9.61812911e-3F));
  const Floats p2 = p4 * f2 + (floats(5.55041087e-2F) * f + floats(2.40226507e-1F));
  const Floats p = p2 * f2 + (floats(6.93147181e-1F) * f + floats(1.0F));
  return masked(kept, p * reinterpret_cast<Floats>(exponent));
}

struct Symmetric {
  Floats xx{}, xy{}, xz{}, yy{}, yz{}, zz{};
};

struct Distributions {
  Floats x, y, z;  // means
  Symmetric c;
};

/// One Gaussian per lane: rows are loaded whole and transposed.
inline Distributions gather(const Map& map, const std::uint32_t* of) {
  const float* rows[kLanes];
  for (std::size_t lane = 0; lane < kLanes; ++lane) rows[lane] = map.rows[of[lane]].mean;
  const Columns first = columns(rows, 0), second = columns(rows, 4);
  Distributions d{.x = first.of[0],
                  .y = first.of[1],
                  .z = first.of[2],
                  .c = {.xx = first.of[3],
                        .xy = second.of[0],
                        .xz = second.of[1],
                        .yy = second.of[2],
                        .yz = second.of[3]}};
  for (std::size_t lane = 0; lane < kLanes; ++lane) d.c.zz[lane] = map.zz[of[lane]];
  return d;
}

/// Looks up the Gaussians of the voxels that points of this batch have entered.
class Lookup {
 public:
  Lookup(const Map& map, const Search& search)
      : map_(map), search_(search), surroundings_(search.only_faces ? map.surroundings : nullptr) {}

  void refill(Batch& batch, Gaussians* lists, const std::int32_t (&now)[3][kBatch]) {
    for (std::size_t lane = 0; lane < kBatch; ++lane) {
      const std::int32_t x = now[0][lane], y = now[1][lane], z = now[2][lane];
      if (x == batch.voxel[0][lane] && y == batch.voxel[1][lane] && z == batch.voxel[2][lane]) {
        continue;
      }
      batch.voxel[0][lane] = x;
      batch.voxel[1][lane] = y;
      batch.voxel[2][lane] = z;
      find(x, y, z);
      batch.found[lane] = found_;
      if (map_.has_bare) {
        batch.kind[lane] = static_cast<std::int32_t>(kind_);
        for (std::size_t kind = 0; kind < kKinds; ++kind) {
          batch.compared[kind][lane] = kind == kind_ && compared_ ? 1.0F : 0.0F;
        }
      }
      for (std::uint32_t s = 0; s < search_.size; ++s) lists[s].of[lane] = last_[s];
    }
    batch.used = 0;
    for (std::uint32_t s = 0; s < search_.size; ++s) {
      Ints used{};
      for (std::size_t lane = 0; lane < kBatch; lane += kLanes) {
        const auto* of = reinterpret_cast<const std::int32_t*>(lists[s].of + lane);
        used |= load(of) != ints(static_cast<std::int32_t>(map_.nothing));
      }
      batch.used |= (any(used) ? 1U : 0U) << s;
    }
  }

 private:
  /// Consecutive points of a scan often share a voxel, so the last answer is kept.
  void find(std::int32_t x, std::int32_t y, std::int32_t z) {
    if (x == x_ && y == y_ && z == z_) return;
    x_ = x;
    y_ = y;
    z_ = z;
    found_ = 0.0F;
    kind_ = kKinds;
    compared_ = false;
    const std::uint32_t ux = static_cast<std::uint32_t>(x) + static_cast<std::uint32_t>(kHalfRange);
    const std::uint32_t uy = static_cast<std::uint32_t>(y) + static_cast<std::uint32_t>(kHalfRange);
    const std::uint32_t uz = static_cast<std::uint32_t>(z) + static_cast<std::uint32_t>(kHalfRange);
    const bool inside =
        ux - 1U < kIndexEnd - 1U && uy - 1U < kIndexEnd - 1U && uz - 1U < kIndexEnd - 1U;
    if (!inside) return find_nothing();
    const std::uint64_t key = key_of_shifted(ux, uy, uz);
    const Block& own = block_at(map_.blocks, key >> 6U);
    const std::uint64_t bit = std::uint64_t{1} << (key & 63U);
    const bool occupied = ((own.voxels | own.bare) & bit) != 0;
    if (surroundings_ != nullptr && !is_free(own)) {
      const Surroundings& around = surroundings_[&own - map_.blocks.slots];
      if ((around.gaussians & bit) == 0) {
        if ((around.occupied & bit) != 0) kind_ = occupied ? 0 : 1;
        return find_nothing();
      }
    }
    const bool beside = find_around(ux, uy, uz, own, key);
    if (!map_.has_bare || !(occupied || beside)) return;
    kind_ = occupied ? 0 : 1;
    compared_ = occupied ? (own.voxels & bit) != 0 : found_ > 0.0F;
  }

  void find_nothing() {
    for (std::uint32_t s = 0; s < search_.size; ++s) last_[s] = map_.nothing;
  }

  /// Finds the Gaussians at all steps; whether one of the voxels there is occupied.
  bool find_around(std::uint32_t x, std::uint32_t y, std::uint32_t z, const Block& own,
                   std::uint64_t own_key) {
    bool occupied = false;
    for (std::uint32_t s = 0; s < search_.size; ++s) {
      const std::uint64_t key = key_of_shifted(x + static_cast<std::uint32_t>(search_.steps[s][0]),
                                               y + static_cast<std::uint32_t>(search_.steps[s][1]),
                                               z + static_cast<std::uint32_t>(search_.steps[s][2]));
      const Block& block = key >> 6U == own_key >> 6U ? own : block_at(map_.blocks, key >> 6U);
      const std::uint32_t gaussian = gaussian_in(block, key & 63U);
      last_[s] = gaussian == kNoGaussian ? map_.nothing : gaussian;
      found_ += gaussian == kNoGaussian ? 0.0F : 1.0F;
      occupied |= ((block.voxels | block.bare) >> (key & 63U) & 1U) != 0;
    }
    return occupied;
  }

  const Map& map_;
  const Search& search_;
  const Surroundings* surroundings_;  // Map::surroundings, if they cover the search
  std::int32_t x_ = kUnknown, y_ = kUnknown, z_ = kUnknown;
  float found_ = 0.0F;
  std::size_t kind_ = kKinds;
  bool compared_ = false;  // the point stands for its kind
  std::uint32_t last_[27] = {};
};

struct QuadraticLanes {
  Floats tt[6] = {}, tr[9] = {}, rr[6] = {};
};

/// Adds J^T A J for J = [I, -[y]x].
inline void add_to_pose(const Symmetric& A, Floats a, Floats b, Floats c, QuadraticLanes& sum) {
  // M = A (-[y]x); the rotation's block is [y]x M.
  const Floats m00 = b * A.xz - c * A.xy, m01 = c * A.xx - a * A.xz, m02 = a * A.xy - b * A.xx;
  const Floats m10 = b * A.yz - c * A.yy, m11 = c * A.xy - a * A.yz, m12 = a * A.yy - b * A.xy;
  const Floats m20 = b * A.zz - c * A.yz, m21 = c * A.xz - a * A.zz, m22 = a * A.yz - b * A.xz;
  sum.tt[0] += A.xx;
  sum.tt[1] += A.xy;
  sum.tt[2] += A.xz;
  sum.tt[3] += A.yy;
  sum.tt[4] += A.yz;
  sum.tt[5] += A.zz;
  sum.tr[0] += m00;
  sum.tr[1] += m01;
  sum.tr[2] += m02;
  sum.tr[3] += m10;
  sum.tr[4] += m11;
  sum.tr[5] += m12;
  sum.tr[6] += m20;
  sum.tr[7] += m21;
  sum.tr[8] += m22;
  sum.rr[0] += b * m20 - c * m10;
  sum.rr[1] += b * m21 - c * m11;
  sum.rr[2] += b * m22 - c * m12;
  sum.rr[3] += c * m01 - a * m21;
  sum.rr[4] += c * m02 - a * m22;
  sum.rr[5] += a * m12 - b * m02;
}

struct SumLanes {
  Floats value{}, mean{}, best{}, matched{};
  Floats of_kind[kKinds] = {}, compared[kKinds] = {}, best_of_kind[kKinds] = {},
         mean_of_kind[kKinds] = {};
  Floats gradient[3] = {}, torque[9] = {};
  QuadraticLanes positive, negative;
};

void write(const QuadraticLanes& from, Quadratic& to) {
  for (int i = 0; i < 6; ++i) to.tt[i] = sum_of(from.tt[i]);
  for (int i = 0; i < 9; ++i) to.tr[i] = sum_of(from.tr[i]);
  for (int i = 0; i < 6; ++i) to.rr[i] = sum_of(from.rr[i]);
}

void write(const SumLanes& from, Sums& to) {
  to.value = sum_of(from.value);
  to.mean = sum_of(from.mean);
  to.best = sum_of(from.best);
  to.matched = sum_of(from.matched);
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    to.of_kind[kind] = sum_of(from.of_kind[kind]);
    to.compared[kind] = sum_of(from.compared[kind]);
    to.best_of_kind[kind] = sum_of(from.best_of_kind[kind]);
    to.mean_of_kind[kind] = sum_of(from.mean_of_kind[kind]);
  }
  for (int i = 0; i < 3; ++i) to.gradient[i] = sum_of(from.gradient[i]);
  for (int i = 0; i < 9; ++i) to.torque[i] = sum_of(from.torque[i]);
  write(from.positive, to.positive);
  write(from.negative, to.negative);
}

/// One point per lane, in the map's axes.
struct Placed {
  Floats y[3];         // seen from the sensor
  Floats in_voxel[3];  // [0, 1)
  Ints voxel[3];
};

inline Placed place(const Pose& pose, Floats px, Floats py, Floats pz) {
  Placed at;
  for (int i = 0; i < 3; ++i) {
    const float* r = pose.rotation + 3 * i;
    at.y[i] = floats(r[0]) * px + floats(r[1]) * py + floats(r[2]) * pz;
    const Floats x = at.y[i] + floats(pose.translation[i]);
    const Ints truncated = __builtin_convertvector(x, Ints);
    const Ints down = __builtin_convertvector(truncated, Floats) > x;  // -1 or 0
    const Ints floor = truncated + down;
    at.in_voxel[i] = x - __builtin_convertvector(floor, Floats);
    at.voxel[i] = floor + ints(pose.voxel[i]);
  }
  return at;
}

template <Terms kTerms, bool kWithinEdge>
inline void add(const Task& task, const Placed& at, const Batch& batch, std::size_t lane,
                const Gaussians* lists, SumLanes& sums) {
  const Floats minus_half_d2 = floats(-task.coefficients.half_d2);
  const float start = task.coefficients.best_is_least ? -1e30F : 0.0F;
  Symmetric positive, negative;
  Floats value{}, gx{}, gy{}, gz{}, found{}, best = floats(start);
  for (std::uint32_t left = batch.used; left != 0; left &= left - 1) {
    const auto s = static_cast<std::uint32_t>(__builtin_ctz(left));
    const std::uint32_t* of = lists[s].of + lane;
    const float* step = task.search.offsets[s];
    const Distributions d = gather(task.map, of);
    const Floats qx = at.in_voxel[0] - floats(step[0]) - d.x;
    const Floats qy = at.in_voxel[1] - floats(step[1]) - d.y;
    const Floats qz = at.in_voxel[2] - floats(step[2]) - d.z;
    const Floats ux = d.c.xx * qx + d.c.xy * qy + d.c.xz * qz;
    const Floats uy = d.c.xy * qx + d.c.yy * qy + d.c.yz * qz;
    const Floats uz = d.c.xz * qx + d.c.yz * qy + d.c.zz * qz;
    Floats e = exp_of((qx * ux + qy * uy + qz * uz) * minus_half_d2);
    if constexpr (kWithinEdge) {
      const Ints near = qx * qx + qy * qy + qz * qz < floats(1.0F);
      e = masked(near, e);
      found += masked(near, floats(1.0F));
    }
    value += e;
    if (task.coefficients.best_is_least) {
      Ints counts = load(reinterpret_cast<const std::int32_t*>(of)) !=
                    ints(static_cast<std::int32_t>(task.map.nothing));
      if constexpr (kWithinEdge) counts &= qx * qx + qy * qy + qz * qz < floats(1.0F);
      best = larger(best, counts ? -e : floats(start));
    } else {
      best = larger(best, e);
    }
    if constexpr (kTerms == Terms::score) continue;
    const Floats ex = e * ux, ey = e * uy, ez = e * uz;
    gx += ex;
    gy += ey;
    gz += ez;
    positive.xx += e * d.c.xx;
    positive.xy += e * d.c.xy;
    positive.xz += e * d.c.xz;
    positive.yy += e * d.c.yy;
    positive.yz += e * d.c.yz;
    positive.zz += e * d.c.zz;
    if constexpr (kTerms == Terms::everything) {
      negative.xx += ex * ux;
      negative.xy += ex * uy;
      negative.xz += ex * uz;
      negative.yy += ey * uy;
      negative.yz += ey * uz;
      negative.zz += ez * uz;
    }
  }
  if constexpr (!kWithinEdge) found = load(batch.found + lane);
  const Ints matched = found > floats(0.0F);
  const Floats mean = value / larger(found, floats(1.0F));
  sums.value += value;
  sums.matched += masked(matched, floats(1.0F));
  sums.mean += mean;
  sums.best += masked(matched, best);
  if (task.map.has_bare) {
    for (std::size_t kind = 0; kind < kKinds; ++kind) {
      const Floats compared = load(batch.compared[kind] + lane);
      sums.compared[kind] += compared;
      sums.best_of_kind[kind] += masked(compared > floats(0.0F), best);
      sums.mean_of_kind[kind] += compared * mean;
    }
  }
  if constexpr (kTerms == Terms::score) return;
  const Floats g[3] = {gx, gy, gz};
  for (int row = 0; row < 3; ++row) {
    sums.gradient[row] += g[row];
    for (int column = 0; column < 3; ++column)
      sums.torque[3 * row + column] += g[row] * at.y[column];
  }
  add_to_pose(positive, at.y[0], at.y[1], at.y[2], sums.positive);
  if constexpr (kTerms == Terms::everything) {
    add_to_pose(negative, at.y[0], at.y[1], at.y[2], sums.negative);
  }
}

inline void count_kinds(const Batch& batch, SumLanes& sums) {
  for (std::size_t lane = 0; lane < kBatch; lane += kLanes) {
    const Ints of = load(batch.kind + lane);
    for (std::size_t kind = 0; kind < kKinds; ++kind) {
      sums.of_kind[kind] += masked(of == ints(static_cast<std::int32_t>(kind)), floats(1.0F));
    }
  }
}

template <Terms kTerms, bool kWithinEdge>
void run(const Task& task, std::size_t first, std::size_t last, Sums& sums) {
  SumLanes lanes;
  Lookup lookup(task.map, task.search);
  for (std::size_t b = first; b < last; b += task.stride) {
    Batch& batch = task.scan.batches[b];
    Gaussians* lists = task.scan.neighbours + b * task.search.size;
    Placed at[kBatch / kLanes];
    alignas(32) std::int32_t now[3][kBatch];
    Ints changed{};
    for (std::size_t part = 0; part < kBatch / kLanes; ++part) {
      const std::size_t lane = part * kLanes;
      at[part] = place(task.pose, load(batch.x + lane), load(batch.y + lane), load(batch.z + lane));
      for (int axis = 0; axis < 3; ++axis) {
        store(now[axis] + lane, at[part].voxel[axis]);
        changed |= at[part].voxel[axis] != load(batch.voxel[axis] + lane);
      }
    }
    if (any(changed)) lookup.refill(batch, lists, now);
    if (task.map.has_bare) count_kinds(batch, lanes);
    if (batch.used == 0) continue;
    for (std::size_t part = 0; part < kBatch / kLanes; ++part) {
      add<kTerms, kWithinEdge>(task, at[part], batch, part * kLanes, lists, lanes);
    }
  }
  write(lanes, sums);
}

template <bool kWithinEdge>
void run(const Task& task, std::size_t first, std::size_t last, Sums& sums) {
  switch (task.terms) {
    case Terms::score: return run<Terms::score, kWithinEdge>(task, first, last, sums);
    case Terms::majorizer: return run<Terms::majorizer, kWithinEdge>(task, first, last, sums);
    case Terms::everything: break;
  }
  return run<Terms::everything, kWithinEdge>(task, first, last, sums);
}

}  // namespace

void VANTAGE_NDT_EVALUATE(const Task& task, std::size_t first, std::size_t last, Sums& sums) {
  if (task.search.within_edge) return run<true>(task, first, last, sums);
  return run<false>(task, first, last, sums);
}

}  // namespace vantage::ndt::kernel
