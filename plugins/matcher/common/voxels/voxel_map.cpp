#include "voxel_map.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "common/extent.hpp"
#include "common/parallel.hpp"

namespace vantage::ndt {
namespace {

constexpr std::size_t kFirstCapacity = 1024;
constexpr std::size_t kVoxelChunk = 256;
constexpr double kShift = kHalfRange;
constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// floor(p / resolution), exactly.
class Lattice {
 public:
  explicit Lattice(double resolution) : resolution_(resolution), inverse_(1.0 / resolution) {
    int exponent = 0;
    exact_ = std::frexp(resolution, &exponent) == 0.5;  // a power of two has an exact inverse
  }
  [[nodiscard]] Eigen::Vector3d in_voxels(const Point& p) const noexcept {
    return exact_ ? Eigen::Vector3d(p * inverse_) : Eigen::Vector3d(p / resolution_);
  }

 private:
  double resolution_, inverse_;
  bool exact_ = false;
};

/// For |x| < 2^63; std::floor is a function call on processors without SSE 4.1.
std::int64_t floor_of(double x) noexcept {
  const auto whole = static_cast<std::int64_t>(x);
  return whole - (static_cast<double>(whole) > x ? 1 : 0);
}

bool in_range(const Eigen::Vector3d& index) noexcept {
  return (index.array() >= 1.0).all() && (index.array() < double{kIndexEnd}).all();
}

/// The indices of which key_of_shifted makes a key.
std::array<std::uint32_t, 3> shifted_of(VoxelKey key) noexcept {
  const auto axis = [&](unsigned block_shift, unsigned place_shift) {
    return static_cast<std::uint32_t>(((key >> (block_shift + 6U)) & 0x7FFFFU) << 2U |
                                      ((key >> place_shift) & 3U));
  };
  return {axis(38, 4), axis(19, 2), axis(0, 0)};
}

/// Sums up points voxel by voxel. It looks up blocks of voxels, because the table then stays small
/// and consecutive points of a map mostly stay in one block.
class Voxels {
 public:
  Voxels() { resize(kFirstCapacity); }

  [[nodiscard]] Moments& operator[](VoxelKey key) {
    if (key >> 6U != last_block_) {
      last_block_ = key >> 6U;
      last_ = 64 * std::size_t{block_of(last_block_)};
    }
    std::uint32_t& place = places_[last_ + (key & 63U)];
    if (place == kNone) {
      place = static_cast<std::uint32_t>(keys_.size());
      keys_.push_back(key);
      moments_.emplace_back();
    }
    return moments_[place];
  }
  /// In the order of their first points.
  [[nodiscard]] std::span<const VoxelKey> keys() const noexcept { return keys_; }
  [[nodiscard]] std::span<const Moments> moments() const noexcept { return moments_; }

 private:
  struct Slot {
    std::uint64_t key = kNoVoxel;
    std::uint32_t block = kNone;
  };
  [[nodiscard]] Slot& slot_for(std::uint64_t key) noexcept {
    std::size_t slot = slot_of(key, shift_);
    while (slots_[slot].key != key && slots_[slot].key != kNoVoxel) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    return slots_[slot];
  }
  /// The number of a block; its first point creates it.
  [[nodiscard]] std::uint32_t block_of(std::uint64_t key) {
    Slot& slot = slot_for(key);
    if (slot.key == key) return slot.block;
    const auto fresh = static_cast<std::uint32_t>(places_.size() / 64);
    slot = {key, fresh};
    places_.resize(places_.size() + 64, kNone);
    if (2 * places_.size() / 64 > slots_.size()) {
      const std::vector<Slot> before = std::move(slots_);
      resize(4 * before.size());
      for (const Slot& old : before) {
        if (old.key != kNoVoxel) slot_for(old.key) = old;
      }
    }
    return fresh;
  }
  void resize(std::size_t capacity) {
    slots_.assign(capacity, {});
    shift_ = static_cast<std::uint32_t>(64 - std::countr_zero(capacity));
  }

  std::vector<Slot> slots_;
  std::uint32_t shift_ = 0;
  std::vector<std::uint32_t> places_;  // of the 64 voxels of each block
  std::vector<VoxelKey> keys_;
  std::vector<Moments> moments_;
  std::uint64_t last_block_ = kNoVoxel;
  std::size_t last_ = 0;
};

/// Precondition: every point lies in range of the origin.
Voxels sum_up(PointsView points, const Lattice& lattice, const Eigen::Vector3d& origin) {
  const std::array<std::int64_t, 3> shift{kHalfRange - static_cast<std::int64_t>(origin.x()),
                                          kHalfRange - static_cast<std::int64_t>(origin.y()),
                                          kHalfRange - static_cast<std::int64_t>(origin.z())};
  Voxels voxels;
  for (const Point& p : points) {
    const Eigen::Vector3d at = lattice.in_voxels(p);
    const std::int64_t x = floor_of(at.x()), y = floor_of(at.y()), z = floor_of(at.z());
    const VoxelKey key = key_of_shifted(static_cast<std::uint32_t>(x + shift[0]),
                                        static_cast<std::uint32_t>(y + shift[1]),
                                        static_cast<std::uint32_t>(z + shift[2]));
    // Also if the voxel is that of the last point: a branch for this case would be unpredictable
    // and cost more.
    voxels[key].add(at.x() - (static_cast<double>(x) + 0.5),
                    at.y() - (static_cast<double>(y) + 0.5),
                    at.z() - (static_cast<double>(z) + 0.5));
  }
  return voxels;
}

/// The Gaussians of the voxels with enough points, in the order of their keys.
struct Gaussians {
  PageVector<VoxelKey> keys;
  PageVector<Cell> cells;
};
Gaussians gaussians_of(const Voxels& voxels, const VoxelOptions& options) {
  std::vector<std::pair<VoxelKey, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < voxels.keys().size(); ++i) {
    if (voxels.moments()[i].points() >= options.min_points) order.emplace_back(voxels.keys()[i], i);
  }
  std::ranges::sort(order);
  std::vector<std::optional<Cell>> made(order.size());
  matching::for_each_chunk(
      order.size(), kVoxelChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          made[i] = cell_of(voxels.moments()[order[i].second], options.eigenvalue_floor);
        }
      });
  Gaussians found;
  found.keys.reserve(made.size());
  found.cells.reserve(made.size());
  for (std::size_t i = 0; i < made.size(); ++i) {
    if (!made[i]) continue;
    found.keys.push_back(order[i].first);
    found.cells.push_back(*made[i]);
  }
  return found;
}

/// A cell of which nothing is known but that it has points.
Cell evenly_filled(std::uint32_t points) {
  // The standard deviation of a uniform distribution is 1 / sqrt(12) = 0.577 / 2 edges.
  constexpr std::uint16_t kDiagonal = 37837;
  return {.mean = {32768, 32768, 32768},
          .lower = {},
          .diagonal = {kDiagonal, kDiagonal, kDiagonal},
          .exponent = 1,
          .points = points};
}

/// @param keys   counted from `origin_voxel`
/// @param which  of the keys
VoxelMap::Part centred(const Eigen::Vector3d& origin_voxel, std::span<const VoxelKey> keys,
                       std::span<const std::uint32_t> which) {
  VoxelMap::Part part{.origin_voxel = Eigen::Vector3d::Zero(), .keys = {}};
  if (which.empty()) return part;
  using Index = Eigen::Array<std::int64_t, 3, 1>;
  const auto index_of = [&](std::uint32_t i) -> Index {
    const auto [x, y, z] = shifted_of(keys[i]);
    return {x, y, z};
  };
  Index low = index_of(which.front()), high = low;
  for (const std::uint32_t i : which) {
    low = low.min(index_of(i));
    high = high.max(index_of(i));
  }
  const Index world = origin_voxel.cast<std::int64_t>().array() - std::int64_t{kHalfRange};
  const Index middle = (low + high + 2 * world).unaryExpr([](std::int64_t twice) {
    return twice >> 1U;  // downwards, also below 0
  });
  part.origin_voxel = middle.cast<double>();
  part.keys.reserve(which.size());
  for (const std::uint32_t i : which) {
    const Index at = index_of(i) + world - middle + std::int64_t{kHalfRange};
    part.keys.emplace_back(
        key_of_shifted(static_cast<std::uint32_t>(at.x()), static_cast<std::uint32_t>(at.y()),
                       static_cast<std::uint32_t>(at.z())),
        i);
  }
  std::ranges::sort(part.keys);
  return part;
}

bool fits(const Bounds3& bounds, const VoxelOptions& options, const Eigen::Vector3d& origin) {
  const auto index = [&](const Point& p) -> Eigen::Vector3d {
    return (p / options.resolution).array().floor() - origin.array() + kShift;
  };
  return in_range(index(bounds.min)) && in_range(index(bounds.max));
}

}  // namespace

Result<VoxelMap> VoxelMap::build(PointsView map, const VoxelOptions& options) {
  VANTAGE_CHECK(check_points(map, "the map"));
  const Bounds3 bounds = bounds_of(map);
  const Eigen::Vector3d centre = 0.5 * bounds.min + 0.5 * bounds.max;
  const Eigen::Vector3d origin = (centre / options.resolution).array().round();
  if (!fits(bounds, options, origin)) return fail(matching::too_wide(map, options.resolution));
  const Voxels voxels = sum_up(map, Lattice(options.resolution), origin);

  auto [keys, cells] = gaussians_of(voxels, options);
  if (cells.empty()) {
    return fail(ErrorCode::too_few_matches,
                "the map is too sparse: no voxel of " + std::to_string(options.resolution) +
                    " m holds " + std::to_string(options.min_points) + " distinct points");
  }
  // From the middle of the voxels that have a Gaussian, so that an excerpt of all of them counts
  // from the same origin.
  std::vector<std::uint32_t> all(keys.size());
  std::iota(all.begin(), all.end(), 0U);
  const Part part = centred(origin, keys, all);
  PageVector<Cell> ordered;
  ordered.reserve(cells.size());
  keys.clear();
  for (const auto& [key, i] : part.keys) {
    keys.push_back(key);
    ordered.push_back(cells[i]);
  }
  return VoxelMap(options, part.origin_voxel, std::move(keys), std::move(ordered));
}

VoxelMap VoxelMap::merged() const {
  const Eigen::Vector3d origin = (0.5 * origin_voxel_).array().floor();
  // 1 where the origin is the upper one of its pair.
  const Eigen::Vector3d odd = origin_voxel_ - 2.0 * origin;
  const std::array<std::uint32_t, 3> shift{static_cast<std::uint32_t>(odd.x()),
                                           static_cast<std::uint32_t>(odd.y()),
                                           static_cast<std::uint32_t>(odd.z())};
  Voxels voxels;
  const auto add = [&](VoxelKey key, const Cell& cell) {
    const auto [x, y, z] = shifted_of(key);
    const std::uint32_t a = x + shift[0], b = y + shift[1], c = z + shift[2];
    constexpr std::uint32_t kHalf = kHalfRange;  // even: it does not change which half
    voxels[key_of_shifted((a + kHalf) >> 1U, (b + kHalf) >> 1U, (c + kHalf) >> 1U)].add(
        cell,
        {static_cast<double>(a & 1U), static_cast<double>(b & 1U), static_cast<double>(c & 1U)});
  };
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    Cell cell = cells_[i];
    if (!bare_.empty()) cell.points = options_.min_points;
    add(keys_[i], cell);
  }
  for (const VoxelKey key : bare_) add(key, evenly_filled(options_.min_points));
  VoxelOptions options = options_;
  options.resolution *= 2.0;
  auto [keys, cells] = gaussians_of(voxels, options);
  return {options, origin, std::move(keys), std::move(cells)};
}

VoxelMap::Part VoxelMap::part(std::span<const std::uint32_t> which) const {
  return centred(origin_voxel_, keys_, which);
}

VoxelMap::VoxelMap(const VoxelOptions& options, const Eigen::Vector3d& origin_voxel,
                   PageVector<VoxelKey> keys, PageVector<Cell> cells, PageVector<VoxelKey> bare)
    : options_(options),
      origin_voxel_(origin_voxel),
      keys_(std::move(keys)),
      cells_(std::move(cells)),
      bare_(std::move(bare)),
      rows_(cells_.size() + 1),
      zz_(cells_.size() + 1, 1.0F) {
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Gaussian g = gaussian_of(cells_[i]);
    const auto f = [](double x) { return static_cast<float>(x); };
    rows_[i] = {.mean = {f(g.mean.x()), f(g.mean.y()), f(g.mean.z())},
                .xx = f(g.xx),
                .xy = f(g.xy),
                .xz = f(g.xz),
                .yy = f(g.yy),
                .yz = f(g.yz)};
    zz_[i] = f(g.zz);
  }
  // The exponential of this distance is 0, whatever d2.
  rows_.back() = {
      .mean = {1e15F, 0.0F, 0.0F}, .xx = 1.0F, .xy = 0.0F, .xz = 0.0F, .yy = 1.0F, .yz = 0.0F};

  std::size_t blocks = 0;
  for (const auto& voxels : {std::span<const VoxelKey>(keys_), std::span<const VoxelKey>(bare_)}) {
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      if (i == 0 || voxels[i] >> 6U != voxels[i - 1] >> 6U) ++blocks;
    }
  }
  blocks_.resize(std::bit_ceil(2 * blocks + 2));
  shift_ = static_cast<std::uint32_t>(64 - std::countr_zero(blocks_.size()));
  const auto block_of = [&](VoxelKey key) -> Block& {
    return blocks_[static_cast<std::size_t>(&block_at(table(), key >> 6U) - blocks_.data())];
  };
  Block* block = nullptr;
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (block == nullptr || block->key != keys_[i] >> 6U) {
      block = &block_of(keys_[i]);
      *block = {
          .key = keys_[i] >> 6U, .voxels = 0, .bare = 0, .first = static_cast<std::uint32_t>(i)};
    }
    block->voxels |= std::uint64_t{1} << (keys_[i] & 63U);
  }
  for (const VoxelKey key : bare_) {
    Block& of_bare = block_of(key);
    of_bare.key = key >> 6U;
    of_bare.bare |= std::uint64_t{1} << (key & 63U);
  }
  if (!bare_.empty()) find_surroundings();
}

void VoxelMap::find_surroundings() {
  // Of the four layers across an axis, the first and the last, and how far a step shifts a bit.
  struct Axis {
    std::uint64_t first, last;
    unsigned step, block;  // bits of a voxel's place, and of the block's key
  };
  constexpr std::array<Axis, 3> kAxes{{{0x0000'0000'0000'FFFF, 0xFFFF'0000'0000'0000, 16, 38},
                                       {0x000F'000F'000F'000F, 0xF000'F000'F000'F000, 4, 19},
                                       {0x1111'1111'1111'1111, 0x8888'8888'8888'8888, 1, 0}}};
  surroundings_.assign(blocks_.size(), {});
  const auto around = [&](const Block& block) -> kernel::Surroundings& {
    return surroundings_[static_cast<std::size_t>(&block - blocks_.data())];
  };
  for (const Block& block : blocks_) {
    if (is_free(block)) continue;
    const auto spread = [&](std::uint64_t voxels, std::uint64_t kernel::Surroundings::*to) {
      around(block).*to |= voxels;
      for (const auto& [first, last, step, in_key] : kAxes) {
        around(block).*to |= (voxels & ~last) << step | (voxels & ~first) >> step;
        const std::uint64_t beside = std::uint64_t{1} << in_key;
        // What is written for a free slot is not read.
        around(block_at(table(), block.key + beside)).*to |= (voxels & last) >> 3 * step;
        around(block_at(table(), block.key - beside)).*to |= (voxels & first) << 3 * step;
      }
    };
    spread(block.voxels, &kernel::Surroundings::gaussians);
    spread(block.voxels | block.bare, &kernel::Surroundings::occupied);
  }
}

std::size_t VoxelMap::bytes() const noexcept {
  return bytes_of(keys_) + bytes_of(cells_) + bytes_of(bare_) + bytes_of(blocks_) +
         bytes_of(surroundings_) + bytes_of(rows_) + bytes_of(zz_);
}

VoxelKey VoxelMap::key_of(const Point& p) const noexcept {
  const Eigen::Vector3d index =
      (p / options_.resolution).array().floor() - origin_voxel_.array() + kShift;
  if (!in_range(index)) return kNoVoxel;
  return key_of_shifted(static_cast<std::uint32_t>(index.x()),
                        static_cast<std::uint32_t>(index.y()),
                        static_cast<std::uint32_t>(index.z()));
}

Point VoxelMap::mean_of(std::uint32_t gaussian) const noexcept {
  return (origin_voxel_ + corner_of(keys_[gaussian]) + gaussian_of(cells_[gaussian]).mean) *
         options_.resolution;
}

Eigen::Vector3d VoxelMap::corner_of(VoxelKey key) noexcept {
  const auto [x, y, z] = shifted_of(key);
  return {x - kShift, y - kShift, z - kShift};
}

kernel::Map VoxelMap::view() const noexcept {
  return {.blocks = table(),
          .rows = rows_.data(),
          .zz = zz_.data(),
          .nothing = static_cast<std::uint32_t>(cells_.size()),
          .has_bare = !bare_.empty(),
          .surroundings = surroundings_.empty() ? nullptr : surroundings_.data()};
}

}  // namespace vantage::ndt
