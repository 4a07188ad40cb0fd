#include "common/surfel_excerpt.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/stored_bytes.hpp"
#include "occupancy.hpp"
#include "vantage/kit/bit_coder.hpp"
#include "voxel_checks.hpp"

namespace vantage::matching {
namespace {

constexpr StoredFormat kFormat{
    .letters = {'V', 'S', 'F', 'L'}, .version = 1, .header = 60, .name = "map of surfels"};
constexpr std::uint16_t kWhole = 0, kSome = 1;  // forms: the kept surfels are all, or some
// Bits of a coordinate within its cube of a metre.
constexpr unsigned bits_of(std::uint16_t form) { return form == kWhole ? 12 : 10; }
constexpr std::size_t bytes_of_surfels(std::size_t surfels, std::uint16_t form) {
  return (surfels * (3 * bits_of(form) + 2 * kNormalBits) + 7) / 8;
}

constexpr std::uint32_t kNormalSteps = (1U << kNormalBits) - 2;  // so that 0 is a step
constexpr std::uint32_t kNoNormal = kNormalSteps + 1;

/// Codes how many surfels each cube has, in unary: a cube has one more, or no more.
class Counts {
 public:
  /// @param count  ignored by a decoder
  /// @param most   a decoder ends here
  template <class Coder>
  std::size_t code(Coder& coder, std::size_t count, std::size_t most) {
    std::size_t so_far = 0;
    while (so_far < most && coder.code(more_[std::min(so_far, kLast)], so_far < count)) ++so_far;
    return so_far;
  }

 private:
  static constexpr std::size_t kLast = 63;
  std::array<Chance, kLast + 1> more_{};
};

/// Cubes of a metre, at whole metres of the map's frame.
using Cube = Eigen::Array<std::int64_t, 3, 1>;

struct Placed {
  std::uint64_t key;     // of its cube
  std::uint32_t surfel;  // in the map
};
struct Part {
  Cube origin;
  std::vector<Placed> surfels;  // by cube, then by number
};

Cube cube_of(const Point& at) { return at.array().floor().cast<std::int64_t>(); }

/// Sorts surfels by cubes, which are counted from their own middle: so the bytes do not depend on
/// where the map's origin is.
Result<Part> placed(const SurfelMap& map, std::span<const std::uint32_t> which) {
  Part part{.origin = Cube::Zero(), .surfels = {}};
  if (which.empty()) return part;
  const auto at = [&](std::uint32_t i) { return cube_of(map.points()[i] + map.origin()); };
  const auto is_near = [&](std::uint32_t i) {
    return ((map.points()[i] + map.origin()).array().abs() < 0x1p53).all();
  };
  if (!std::ranges::all_of(which, is_near)) {
    return fail(ErrorCode::invalid_input,
                "the surfels lie more than 2^53 m from zero, which a prepared map cannot");
  }
  Cube low = at(which.front()), high = low;
  for (const std::uint32_t i : which) {
    low = low.min(at(i));
    high = high.max(at(i));
  }
  if ((high - low).maxCoeff() >= 2 * std::int64_t{ndt::kHalfRange} - 4) {
    return fail(ErrorCode::invalid_input,
                "the surfels span more than two million metres, which a prepared map cannot");
  }
  part.origin = (low + high).unaryExpr([](std::int64_t twice) {
    return twice >> 1U;  // downwards, also below 0
  });
  part.surfels.reserve(which.size());
  for (const std::uint32_t i : which) {
    const Cube index = at(i) - part.origin + std::int64_t{ndt::kHalfRange};
    part.surfels.push_back({ndt::key_of_shifted(static_cast<std::uint32_t>(index.x()),
                                                static_cast<std::uint32_t>(index.y()),
                                                static_cast<std::uint32_t>(index.z())),
                            i});
  }
  std::ranges::sort(part.surfels, {}, [](const Placed& p) { return std::pair(p.key, p.surfel); });
  return part;
}

void write(BitWriter& out, const SurfelMap& map, std::uint32_t surfel, std::uint16_t form) {
  const Point at = map.points()[surfel] + map.origin();
  const unsigned bits = bits_of(form);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double inside = at[axis] - std::floor(at[axis]);
    out.number(std::min(static_cast<std::uint32_t>(std::ldexp(inside, static_cast<int>(bits))),
                        (1U << bits) - 1U),
               bits);
  }
  for (const std::uint32_t number : code_of(map.normals()[surfel])) {
    out.number(number, kNormalBits);
  }
}

/// @param is_kept  of a surfel's number
template <class IsKept>
Result<std::vector<std::byte>> encoded(const SurfelMap& map, const SurfelMap::Options& options,
                                       std::span<const std::uint32_t> which, std::size_t kept,
                                       std::uint16_t form, const IsKept& is_kept) {
  VANTAGE_TRY(const Part part, placed(map, which));
  std::vector<std::uint64_t> cubes;
  BitEncoder counts;
  Counts counter;
  BitWriter surfels;
  for (auto first = part.surfels.begin(), last = first; first != part.surfels.end(); first = last) {
    cubes.push_back(first->key);
    std::size_t count = 0;
    for (; last != part.surfels.end() && last->key == first->key; ++last) {
      if (!is_kept(last->surfel)) continue;
      write(surfels, map, last->surfel, form);
      ++count;
    }
    (void)counter.code(counts, count, kept);
  }
  const std::vector<std::byte> code = ndt::encode_occupancy(cubes),
                               each = std::move(counts).finish(),
                               numbers = std::move(surfels).finish();
  ByteWriter out = kFormat.begun(form, code.size() + each.size() + numbers.size());
  out.number(options.voxel);
  out.number(options.neighbours);
  out.number(std::uint32_t{options.planes_only});
  for (Eigen::Index axis = 0; axis < 3; ++axis) out.number(part.origin[axis]);
  out.number(static_cast<std::uint32_t>(kept));
  out.number(static_cast<std::uint32_t>(cubes.size()));
  out.number(static_cast<std::uint32_t>(code.size()));
  out.raw(code);
  out.raw(each);
  out.raw(numbers);
  return StoredFormat::finished(std::move(out));
}

std::string text(const SurfelMap::Options& o) {
  return "map_voxel " + std::to_string(o.voxel) + " m, neighbours " + std::to_string(o.neighbours) +
         (o.planes_only ? ", without" : ", with") + " points that show no plane";
}

/// How many surfels each cube has.
Result<std::vector<std::uint32_t>> counts_of(std::span<const std::byte> bytes, std::size_t cubes,
                                             std::size_t surfels, std::uint16_t form) {
  BitDecoder decoder(bytes);
  Counts counter;
  std::vector<std::uint32_t> counts;
  counts.reserve(cubes);
  std::size_t sum = 0;
  for (std::size_t i = 0; i < cubes; ++i) {
    const std::size_t count = counter.code(decoder, 0, surfels);
    sum += count;
    if (sum > surfels || (form == kWhole && count == 0)) break;
    counts.push_back(static_cast<std::uint32_t>(count));
  }
  if (counts.size() != cubes || sum != surfels || !decoder.is_at_end()) {
    return kFormat.corrupt("its cubes do not hold the surfels that it says");
  }
  return counts;
}

}  // namespace

NormalCode code_of(Eigen::Vector3d normal) noexcept {
  if (normal.isZero(0.0)) return {kNoNormal, kNoNormal};
  if (normal.z() < 0.0) normal = -normal;
  normal /= normal.cwiseAbs().sum();
  const auto number = [](double x) {
    const double steps = std::nearbyint((x + 1.0) * (0.5 * kNormalSteps));
    return static_cast<std::uint32_t>(std::clamp(steps, 0.0, double{kNormalSteps}));
  };
  return {number(normal.x() + normal.y()), number(normal.x() - normal.y())};
}

std::optional<Eigen::Vector3d> normal_of(const NormalCode& code) noexcept {
  if (code == NormalCode{kNoNormal, kNoNormal}) return Eigen::Vector3d::Zero();
  if (std::max(code[0], code[1]) > kNormalSteps) return std::nullopt;
  const double u = code[0] / (0.5 * kNormalSteps) - 1.0, v = code[1] / (0.5 * kNormalSteps) - 1.0;
  const double x = 0.5 * (u + v), y = 0.5 * (u - v);
  return Eigen::Vector3d(x, y, std::max(0.0, 1.0 - std::abs(x) - std::abs(y))).normalized();
}

Result<std::vector<std::byte>> encode(const SurfelMap& map, const SurfelMap::Options& options,
                                      std::span<const std::uint32_t> which) {
  return encoded(map, options, which, which.size(), kWhole, [](std::uint32_t) { return true; });
}

Result<std::vector<std::byte>> encode_some(const SurfelMap& map, const SurfelMap::Options& options,
                                           std::span<const std::uint32_t> which,
                                           std::span<const std::uint32_t> kept) {
  std::vector<bool> is_kept(map.points().size(), false);
  for (const std::uint32_t i : kept) is_kept[i] = true;
  return encoded(map, options, which, kept.size(), kSome,
                 [&](std::uint32_t i) { return is_kept[i]; });
}

Result<StoredSurfels> decode(std::span<const std::byte> bytes, const SurfelMap::Options& wanted) {
  VANTAGE_TRY(auto opened, kFormat.opened(bytes, kSome));
  auto& [in, form] = opened;
  SurfelMap::Options options;
  options.voxel = in.number<double>();
  options.neighbours = in.number<std::uint32_t>();
  const auto planes_only = in.number<std::uint32_t>();
  options.planes_only = planes_only == 1;
  Eigen::Vector3d origin;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    origin[axis] = static_cast<double>(in.number<std::int64_t>());
  }
  if (planes_only > 1 || !ndt::is_origin(origin))
    return kFormat.corrupt("its head has values that no map has");
  if (options != wanted) {
    return fail(ErrorCode::invalid_input, "the stored map of surfels was made with " +
                                              text(options) + "; this matcher has " + text(wanted));
  }
  const auto size = in.number<std::uint32_t>(), cubes = in.number<std::uint32_t>(),
             code_size = in.number<std::uint32_t>();
  const auto code = in.bytes(code_size);
  const std::size_t numbers_size = bytes_of_surfels(size, form);
  if (!in.ok() || in.left() < numbers_size) {
    return kFormat.corrupt("its parts do not have the sizes it says");
  }
  const auto each = in.bytes(in.left() - numbers_size), numbers = in.bytes(numbers_size);
  auto keys = ndt::decode_occupancy(code, cubes);
  if (!keys || !std::ranges::all_of(*keys, ndt::is_voxel)) {
    return kFormat.corrupt("its cubes cannot be decoded");
  }
  VANTAGE_TRY(const std::vector<std::uint32_t> counts, counts_of(each, cubes, size, form));
  if (size == 0) {
    return fail(ErrorCode::too_few_matches, "the stored map of surfels has none");
  }

  PointCloud points;
  std::vector<Eigen::Vector3d> normals;
  points.reserve(size);
  normals.reserve(size);
  BitReader bits(numbers);
  const unsigned width = bits_of(form);
  for (std::size_t cube = 0; cube < cubes; ++cube) {
    const Eigen::Vector3d corner = ndt::VoxelMap::corner_of((*keys)[cube]);
    for (std::uint32_t k = 0; k < counts[cube]; ++k) {
      Eigen::Vector3d inside;
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        inside[axis] = std::ldexp(bits.number(width) + 0.5, -static_cast<int>(width));
      }
      NormalCode normal_code{};
      for (std::uint32_t& number : normal_code) number = bits.number(kNormalBits);
      const auto normal = normal_of(normal_code);
      if (!normal || (options.planes_only && normal->isZero(0.0))) {
        return kFormat.corrupt("surfel " + std::to_string(points.size()) +
                               " has no normal that its matcher makes");
      }
      points.emplace_back(corner + inside);
      normals.push_back(*normal);
    }
  }
  std::optional<ndt::VoxelMap> occupied;
  if (form == kSome) {
    PageVector<ndt::VoxelKey> bare(keys->begin(), keys->end());
    occupied.emplace(ndt::VoxelOptions{}, Eigen::Vector3d::Zero(), PageVector<ndt::VoxelKey>(),
                     PageVector<ndt::Cell>(), std::move(bare));
  }
  return StoredSurfels{.map = SurfelMap(origin, std::move(points), std::move(normals)),
                       .occupied = std::move(occupied)};
}

}  // namespace vantage::matching
