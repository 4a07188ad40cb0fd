#include "excerpt.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstring>
#include <string>
#include <utility>

#include "occupancy.hpp"
#include "vantage/kit/bit_coder.hpp"

namespace vantage::ndt {
namespace {

constexpr std::array<char, 4> kMagic{'V', 'N', 'D', 'T'};
constexpr std::uint16_t kVersion = 1;
constexpr std::size_t kHeader = 56, kChecksum = 8;
constexpr std::size_t kLeastCell = 21;
constexpr std::uint16_t kWhole = 0, kSome = 1;  // forms of what follows the header
// Of `encode_some`: bits of a cell's numbers and of its exponent.
constexpr unsigned kNumber = 12, kExponent = 5, kNumbers = 9;

/// Every step is a bijection of the sum, so a change within eight bytes is always detected.
std::uint64_t checksum(std::span<const std::byte> bytes) {
  std::uint64_t sum = 0xCBF29CE484222325U;
  const auto mix = [&](std::uint64_t word) {
    sum = (sum ^ word) * 0x9E3779B97F4A7C15U;
    sum ^= sum >> 32U;
  };
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    if constexpr (std::endian::native == std::endian::big) word = __builtin_bswap64(word);
    mix(word);
  }
  std::uint64_t rest = 0;
  for (unsigned shift = 0; i < bytes.size(); ++i, shift += 8) {
    rest |= std::to_integer<std::uint64_t>(bytes[i]) << shift;
  }
  mix(rest);
  mix(bytes.size());
  return sum;
}

class Writer {
 public:
  explicit Writer(std::size_t expected) { bytes_.reserve(expected); }

  template <std::integral T>
  void integer(T value) {
    auto bits = static_cast<std::uint64_t>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i, bits >>= 8U) byte(bits & 0xFFU);
  }
  void real(double value) { integer(std::bit_cast<std::uint64_t>(value)); }
  /// Seven bits per byte, lowest first; the eighth bit says that more follow.
  void counted(std::uint64_t value) {
    for (; value >= 0x80U; value >>= 7U) byte((value & 0x7FU) | 0x80U);
    byte(value);
  }
  void bytes(std::span<const std::byte> some) {
    bytes_.insert(bytes_.end(), some.begin(), some.end());
  }
  [[nodiscard]] std::vector<std::byte> finish() && {
    integer(checksum(bytes_));
    return std::move(bytes_);
  }

 private:
  void byte(std::uint64_t value) { bytes_.push_back(static_cast<std::byte>(value)); }
  std::vector<std::byte> bytes_;
};

/// Reads what Writer wrote. Past the end, it reads zeros and remembers that it did.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <std::integral T>
  [[nodiscard]] T integer() {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) bits |= byte() << (8 * i);
    return static_cast<T>(bits);
  }
  [[nodiscard]] double real() { return std::bit_cast<double>(integer<std::uint64_t>()); }
  [[nodiscard]] std::uint64_t counted() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint64_t next = byte();
      value |= (next & 0x7FU) << shift;
      if (next < 0x80U) return value;
    }
    good_ = false;
    return 0;
  }
  /// So many bytes, or none if there are fewer.
  [[nodiscard]] std::span<const std::byte> bytes(std::size_t count) {
    good_ = good_ && count <= left();
    if (!good_) return {};
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - at_; }
  [[nodiscard]] bool good() const noexcept { return good_; }

 private:
  [[nodiscard]] std::uint64_t byte() {
    if (at_ < bytes_.size()) return std::to_integer<std::uint64_t>(bytes_[at_++]);
    good_ = false;
    return 0;
  }
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool good_ = true;
};

/// Numbers of a few bits, one after the other, the lowest bit first.
class BitWriter {
 public:
  void number(std::uint32_t value, unsigned bits) {
    waiting_ |= (value & ((1U << bits) - 1U)) << held_;
    for (held_ += bits; held_ >= 8; held_ -= 8, waiting_ >>= 8U) push();
  }
  /// The last byte is filled up with zeros.
  [[nodiscard]] std::vector<std::byte> finish() && {
    if (held_ > 0) push();
    return std::move(bytes_);
  }

 private:
  void push() { bytes_.push_back(std::byte(waiting_ & 0xFFU)); }
  std::vector<std::byte> bytes_;
  std::uint32_t waiting_ = 0;  // fewer than 8 bits between two numbers
  unsigned held_ = 0;          // how many
};
/// Precondition: no more bits are read than there are.
class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] std::uint32_t number(unsigned bits) {
    for (; held_ < bits; held_ += 8) {
      waiting_ |= std::to_integer<std::uint32_t>(bytes_[at_++]) << held_;
    }
    const std::uint32_t value = waiting_ & ((1U << bits) - 1U);
    waiting_ >>= bits;
    held_ -= bits;
    return value;
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::uint32_t waiting_ = 0;  // bits that were read with those of a number before
  unsigned held_ = 0;          // how many
};
static_assert(kNumber <= 16 && kExponent <= 16);
constexpr std::size_t bytes_of_cells(std::size_t cells) {
  return (cells * (kNumbers * kNumber + kExponent) + 7) / 8;
}

std::string text(const VoxelOptions& o) {
  return "resolution " + std::to_string(o.resolution) + " m, min_points_per_voxel " +
         std::to_string(o.min_points) + ", eigenvalue_floor " + std::to_string(o.eigenvalue_floor);
}

auto corrupt(const std::string& why) {
  return fail(ErrorCode::corrupt_data, "the stored NDT map is damaged: " + why);
}

/// One number for all of a cell's 16-bit fields, in the order of the format.
template <class Cell_, class Use>
void each_field(Cell_& cell, const Use& use) {
  for (auto& x : cell.mean) use(x);
  for (auto& x : cell.lower) use(x);
  for (auto& x : cell.diagonal) use(x);
}

/// Of an axis, the bits of a key (see key_of_shifted).
constexpr VoxelKey bits_of_axis(unsigned axis) {
  return VoxelKey{0x7FFFFU} << (44U - 19U * axis) | VoxelKey{3} << (4U - 2U * axis);
}
bool is_voxel(VoxelKey key) {
  // The first index and the last, which has all bits, are out of range.
  static_assert(kIndexEnd == (1U << 21U) - 1U);
  const auto in_range = [&](VoxelKey bits) { return (key & bits) != 0 && (key & bits) != bits; };
  return key >> 63U == 0 && in_range(bits_of_axis(0)) && in_range(bits_of_axis(1)) &&
         in_range(bits_of_axis(2));
}

bool is_origin(const Eigen::Vector3d& voxel) {
  return (voxel.array().abs() < 0x1p53).all() && voxel == voxel.array().round().matrix();
}

}  // namespace

std::vector<std::uint32_t> gaussians_at(const VoxelMap& map, PointsView seen) {
  std::vector<bool> kept(map.cells().size(), false);
  for (const Point& p : seen) {
    const VoxelKey key = map.key_of(p);
    const std::uint32_t gaussian = key == kNoVoxel ? kNoGaussian : map.find(key);
    if (gaussian != kNoGaussian) kept[gaussian] = true;
  }
  std::vector<std::uint32_t> which;
  for (std::uint32_t i = 0; i < kept.size(); ++i) {
    if (kept[i]) which.push_back(i);
  }
  return which;
}

namespace {

/// @param size  about how many bytes follow the header
Writer begun(const VoxelMap& map, const VoxelMap::Part& part, std::uint16_t form, std::size_t cells,
             std::size_t size) {
  Writer out(kHeader + size + kChecksum);
  for (const char c : kMagic) out.integer(c);
  out.integer(kVersion);
  out.integer(form);
  out.real(map.options().resolution);
  out.real(map.options().eigenvalue_floor);
  for (Eigen::Index axis = 0; axis < 3; ++axis) out.real(part.origin_voxel[axis]);
  out.integer(map.options().min_points);
  out.integer(static_cast<std::uint32_t>(cells));
  return out;
}

}  // namespace

std::vector<std::byte> encode(const VoxelMap& map, std::span<const std::uint32_t> which) {
  const VoxelMap::Part part = map.part(which);
  Writer out = begun(map, part, kWhole, which.size(), which.size() * (kLeastCell + 3));
  VoxelKey before = 0;
  for (const auto& [key, i] : part.keys) {
    const Cell& cell = map.cells()[i];
    out.counted(key - before);
    out.counted(cell.points);
    each_field(cell, [&](auto x) { out.integer(x); });
    out.integer(cell.exponent);
    before = key;
  }
  return std::move(out).finish();
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
  Writer out = begun(map, part, kSome, kept.size(),
                     3 * sizeof(std::uint32_t) + code.size() + chosen.size() + numbers.size());
  out.integer(static_cast<std::uint32_t>(keys.size()));
  out.integer(static_cast<std::uint32_t>(code.size()));
  out.integer(static_cast<std::uint32_t>(chosen.size()));
  out.bytes(code);
  out.bytes(chosen);
  out.bytes(numbers);
  return std::move(out).finish();
}

namespace {

/// What follows the header of `encode_some`.
Result<VoxelMap> decode_some(Reader& in, const VoxelOptions& options, const Eigen::Vector3d& origin,
                             std::uint32_t size) {
  const auto voxels = in.integer<std::uint32_t>();
  const auto code_size = in.integer<std::uint32_t>(), flags_size = in.integer<std::uint32_t>();
  const auto code = in.bytes(code_size), flags = in.bytes(flags_size);
  const auto cells_bytes = in.bytes(bytes_of_cells(size));
  if (!in.good() || in.left() != 0) return corrupt("its parts do not have the sizes it says");
  const auto occupied = decode_occupancy(code, voxels);
  if (!occupied) return corrupt("its voxels cannot be decoded");
  if (size > voxels) return corrupt("it keeps more voxels than are occupied");
  BitDecoder kept(flags);
  Chance is_kept;
  std::vector<VoxelKey> keys, bare;
  keys.reserve(size);
  bare.reserve(voxels - size);
  for (const VoxelKey key : *occupied) {
    if (!is_voxel(key)) return corrupt("a voxel is out of range");
    (kept.code(is_kept, false) ? keys : bare).push_back(key);
  }
  if (keys.size() != size || !kept.is_at_end()) {
    return corrupt("it keeps other voxels than it says");
  }
  BitReader bits(cells_bytes);
  std::vector<Cell> cells(size);
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
  if (bytes.size() < kHeader + kChecksum) return corrupt("it is cut short");
  const std::span<const std::byte> body = bytes.first(bytes.size() - kChecksum);
  if (Reader(bytes.last(kChecksum)).integer<std::uint64_t>() != checksum(body)) {
    return corrupt("its checksum is wrong");
  }
  Reader in(body);
  for (const char c : kMagic) {
    if (in.integer<char>() != c) return corrupt("it does not begin as one");
  }
  if (const auto version = in.integer<std::uint16_t>(); version != kVersion) {
    return corrupt("its format is " + std::to_string(version) + ", not " +
                   std::to_string(kVersion));
  }
  const auto form = in.integer<std::uint16_t>();
  if (form != kWhole && form != kSome) return corrupt("its form is " + std::to_string(form));
  VoxelOptions options;
  options.resolution = in.real();
  options.eigenvalue_floor = in.real();
  Eigen::Vector3d origin;
  for (Eigen::Index axis = 0; axis < 3; ++axis) origin[axis] = in.real();
  options.min_points = in.integer<std::uint32_t>();
  if (!is_origin(origin)) return corrupt("its origin is not a voxel");
  if (options != wanted) {
    return fail(ErrorCode::invalid_input, "the stored NDT map was made with " + text(options) +
                                              "; this matcher has " + text(wanted));
  }
  const auto size = in.integer<std::uint32_t>();
  if (form == kSome) return decode_some(in, options, origin, size);
  if (size > in.left() / kLeastCell) return corrupt("it promises more voxels than it has");

  std::vector<VoxelKey> keys(size);
  std::vector<Cell> cells(size);
  VoxelKey before = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint64_t step = in.counted();
    const std::uint64_t points = in.counted();
    Cell& cell = cells[i];
    each_field(cell, [&](auto& x) { x = in.integer<std::remove_reference_t<decltype(x)>>(); });
    cell.exponent = in.integer<std::uint8_t>();
    cell.points = static_cast<std::uint32_t>(points);
    keys[i] = before + step;
    const bool plausible = in.good() && step > 0 && keys[i] > before && is_voxel(keys[i]) &&
                           points == cell.points && points >= options.min_points &&
                           std::ranges::count(cell.diagonal, 0) == 0 &&
                           cell.exponent <= Cell::kMaxExponent;
    if (!plausible) return corrupt("voxel " + std::to_string(i) + " is none");
    before = keys[i];
  }
  if (in.left() != 0) return corrupt("something follows its voxels");
  if (cells.empty()) {
    return fail(ErrorCode::too_few_matches, "the stored NDT map has no voxels");
  }
  return VoxelMap(options, origin, std::move(keys), std::move(cells));
}

}  // namespace vantage::ndt
