#include "excerpt.hpp"

#include <algorithm>
#include <string>
#include <type_traits>
#include <utility>

#include "common/element_numbers.hpp"
#include "common/stored_bytes.hpp"
#include "occupancy.hpp"
#include "vantage/kit/bit_coder.hpp"
#include "voxel_checks.hpp"

namespace vantage::ndt {
namespace {

using namespace matching;

constexpr StoredFormat kFormat{
    .letters = {'V', 'N', 'D', 'T'}, .version = 1, .header = 56, .name = "NDT map"};
constexpr std::size_t kLeastCell = 21;
constexpr std::uint16_t kWhole = 0, kSome = 1;  // forms of what follows the header
// Of `encode_some`: bits of a cell's numbers and of its exponent.
constexpr unsigned kNumber = 12, kExponent = 5, kNumbers = 9;

static_assert(kNumber <= 16 && kExponent <= 16);
constexpr std::size_t bytes_of_cells(std::size_t cells) {
  return (cells * (kNumbers * kNumber + kExponent) + 7) / 8;
}

std::string text(const VoxelOptions& o) {
  return "resolution " + std::to_string(o.resolution) + " m, min_points_per_voxel " +
         std::to_string(o.min_points) + ", eigenvalue_floor " + std::to_string(o.eigenvalue_floor);
}

/// One number for all of a cell's 16-bit fields, in the order of the format.
template <class Cell_, class Use>
void each_field(Cell_& cell, const Use& use) {
  for (auto& x : cell.mean) use(x);
  for (auto& x : cell.lower) use(x);
  for (auto& x : cell.diagonal) use(x);
}

}  // namespace

std::vector<std::uint32_t> gaussians_at(const VoxelMap& map, PointsView seen) {
  std::vector<bool> kept(map.cells().size(), false);
  for (const Point& p : seen) {
    const VoxelKey key = map.key_of(p);
    const std::uint32_t gaussian = key == kNoVoxel ? kNoGaussian : map.find(key);
    if (gaussian != kNoGaussian) kept[gaussian] = true;
  }
  return numbers_of(kept);
}

namespace {

/// @param size  about how many bytes follow the header
ByteWriter begun(const VoxelMap& map, const VoxelMap::Part& part, std::uint16_t form,
                 std::size_t cells, std::size_t size) {
  ByteWriter out = kFormat.begun(form, size);
  out.number(map.options().resolution);
  out.number(map.options().eigenvalue_floor);
  for (Eigen::Index axis = 0; axis < 3; ++axis) out.number(part.origin_voxel[axis]);
  out.number(map.options().min_points);
  out.number(static_cast<std::uint32_t>(cells));
  return out;
}

}  // namespace

std::vector<std::byte> encode(const VoxelMap& map, std::span<const std::uint32_t> which) {
  const VoxelMap::Part part = map.part(which);
  ByteWriter out = begun(map, part, kWhole, which.size(), which.size() * (kLeastCell + 3));
  VoxelKey before = 0;
  for (const auto& [key, i] : part.keys) {
    const Cell& cell = map.cells()[i];
    out.counted(key - before);
    out.counted(cell.points);
    each_field(cell, [&](auto x) { out.number(x); });
    out.number(cell.exponent);
    before = key;
  }
  return StoredFormat::finished(std::move(out));
}

std::vector<std::byte> encode_some(const VoxelMap& map, std::span<const std::uint32_t> which,
                                   std::span<const std::uint32_t> kept) {
  const VoxelMap::Part part = map.part(which);
  std::vector<bool> is_kept(map.cells().size(), false);
  for (const std::uint32_t i : kept) is_kept[i] = true;
  std::vector<VoxelKey> keys;
  keys.reserve(part.keys.size());
  BitEncoder flags;
  Chance chance;
  BitWriter cells;
  for (const auto& [key, i] : part.keys) {
    keys.push_back(key);
    if (!flags.code(chance, is_kept[i])) continue;
    const Cell& cell = map.cells()[i];
    each_field(cell, [&](auto x) {
      constexpr auto kDropped = 16 - kNumber;
      cells.number(static_cast<std::uint16_t>(x) >> kDropped, kNumber);
    });
    cells.number(cell.exponent, kExponent);
  }
  const std::vector<std::byte> code = encode_occupancy(keys), chosen = std::move(flags).finish(),
                               numbers = std::move(cells).finish();
  ByteWriter out = begun(map, part, kSome, kept.size(),
                         3 * sizeof(std::uint32_t) + code.size() + chosen.size() + numbers.size());
  out.number(static_cast<std::uint32_t>(keys.size()));
  out.number(static_cast<std::uint32_t>(code.size()));
  out.number(static_cast<std::uint32_t>(chosen.size()));
  out.raw(code);
  out.raw(chosen);
  out.raw(numbers);
  return StoredFormat::finished(std::move(out));
}

namespace {

/// What follows the header of `encode_some`.
Result<VoxelMap> decode_some(ByteReader& in, const VoxelOptions& options,
                             const Eigen::Vector3d& origin, std::uint32_t size) {
  const auto voxels = in.number<std::uint32_t>();
  const auto code_size = in.number<std::uint32_t>(), flags_size = in.number<std::uint32_t>();
  const auto code = in.bytes(code_size), flags = in.bytes(flags_size);
  const auto cells_bytes = in.bytes(bytes_of_cells(size));
  if (!in.ok() || in.left() != 0) return kFormat.corrupt("its parts do not have the sizes it says");
  const auto occupied = decode_occupancy(code, voxels);
  if (!occupied) return kFormat.corrupt("its voxels cannot be decoded");
  if (size > voxels) return kFormat.corrupt("it keeps more voxels than are occupied");
  BitDecoder kept(flags);
  Chance is_kept;
  PageVector<VoxelKey> keys, bare;
  keys.reserve(size);
  bare.reserve(voxels - size);
  for (const VoxelKey key : *occupied) {
    if (!is_voxel(key)) return kFormat.corrupt("a voxel is out of range");
    (kept.code(is_kept, false) ? keys : bare).push_back(key);
  }
  if (keys.size() != size || !kept.is_at_end()) {
    return kFormat.corrupt("it keeps other voxels than it says");
  }
  BitReader bits(cells_bytes);
  PageVector<Cell> cells(size);
  for (Cell& cell : cells) {
    each_field(cell, [&](auto& x) {
      constexpr unsigned kDropped = 16 - kNumber;
      const std::uint32_t middle = bits.number(kNumber) << kDropped | 1U << (kDropped - 1);
      x = static_cast<std::remove_reference_t<decltype(x)>>(middle);
    });
    cell.exponent = static_cast<std::uint8_t>(bits.number(kExponent));
    cell.points = options.min_points;
  }
  if (cells.empty()) {
    return fail(ErrorCode::too_few_matches, "the stored NDT map keeps no voxels");
  }
  return VoxelMap(options, origin, std::move(keys), std::move(cells), std::move(bare));
}

}  // namespace

Result<VoxelMap> decode(std::span<const std::byte> bytes, const VoxelOptions& wanted) {
  VANTAGE_TRY(auto opened, kFormat.opened(bytes, kSome));
  auto& in = opened.first;  // not a structured binding: clang 14 cannot capture one
  const auto& form = opened.second;
  VoxelOptions options;
  options.resolution = in.number<double>();
  options.eigenvalue_floor = in.number<double>();
  Eigen::Vector3d origin;
  for (Eigen::Index axis = 0; axis < 3; ++axis) origin[axis] = in.number<double>();
  options.min_points = in.number<std::uint32_t>();
  if (!is_origin(origin)) return kFormat.corrupt("its origin is not a voxel");
  if (options != wanted) {
    return fail(ErrorCode::invalid_input, "the stored NDT map was made with " + text(options) +
                                              "; this matcher has " + text(wanted));
  }
  const auto size = in.number<std::uint32_t>();
  if (form == kSome) return decode_some(in, options, origin, size);
  if (size > in.left() / kLeastCell) return kFormat.corrupt("it promises more voxels than it has");

  PageVector<VoxelKey> keys(size);
  PageVector<Cell> cells(size);
  VoxelKey before = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint64_t step = in.counted();
    const std::uint64_t points = in.counted();
    Cell& cell = cells[i];
    each_field(cell, [&](auto& x) { x = in.number<std::remove_reference_t<decltype(x)>>(); });
    cell.exponent = in.number<std::uint8_t>();
    cell.points = static_cast<std::uint32_t>(points);
    keys[i] = before + step;
    const bool plausible = in.ok() && step > 0 && keys[i] > before && is_voxel(keys[i]) &&
                           points == cell.points && points >= options.min_points &&
                           std::ranges::count(cell.diagonal, 0) == 0 &&
                           cell.exponent <= Cell::kMaxExponent;
    if (!plausible)
      return kFormat.corrupt("voxel " + std::to_string(i) + " has values that no map has");
    before = keys[i];
  }
  if (in.left() != 0) return kFormat.corrupt("something follows its voxels");
  if (cells.empty()) {
    return fail(ErrorCode::too_few_matches, "the stored NDT map has no voxels");
  }
  return VoxelMap(options, origin, std::move(keys), std::move(cells));
}

}  // namespace vantage::ndt
