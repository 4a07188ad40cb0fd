#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "place_index.hpp"
#include "vantage/kit/bit_coder.hpp"
#include "vantage/kit/checksum.hpp"
#include "voxel_rows.hpp"

namespace vantage::voxel_search {
namespace {

using Format = std::array<char, 8>;
constexpr Format kPlacesFormat{'v', 'p', 'l', 'a', 'c', 'e', 's', '3'};
constexpr int kWidth = 64;  // of a strip of voxels

/// What the bytes of an index begin with.
struct Header {
  Format format = kPlacesFormat;
  std::array<std::int32_t, 3> first{}, extent{};  // voxels, without the margin
  std::uint64_t voxels = 0;
};
static_assert(sizeof(Header) == 40);

/// The checksum of a header, to which the rows of voxels are added in the order of their coding.
/// It follows the header.
Checksum checksum_of(const Header& header) {
  Checksum sum;
  for (const auto& numbers : {header.first, header.extent}) {
    for (const std::int32_t number : numbers) sum.add(std::uint32_t(number));
  }
  sum.add(header.voxels);
  return sum;
}

tl::unexpected<Error> no_index(const char* reason) {
  return fail(ErrorCode::corrupt_data, std::string("the bundle's index of places ") + reason);
}

using Keys = std::vector<std::uint64_t>;

/// Reads the rows of voxels as VoxelRows codes them, strip by strip.
Result<Keys> read_rows(const Header& header, std::span<const std::byte> bytes) {
  std::uint64_t checksum = 0;
  if (bytes.size() < sizeof(checksum)) return no_index("is cut off");
  std::memcpy(&checksum, bytes.data(), sizeof(checksum));
  const auto [width, height, layers] = header.extent;
  Checksum sum = checksum_of(header);
  BitDecoder decoder(bytes.subspan(sizeof(checksum)));
  VoxelRows rows(decoder, height);
  Keys keys;
  for (int x = 0; x < width; x += kWidth) {
    rows.begin_strip();
    for (int z = 0; z < layers; ++z) {
      rows.begin_layer();
      for (int y = 0; y < height; ++y) {
        const std::uint64_t row = rows.code(y, std::min(kWidth, width - x), 0);
        if (decoder.is_cut_off()) return no_index("is cut off");
        sum.add(row);
        const std::uint64_t key =
            (std::uint64_t(z) * std::uint64_t(height) + std::uint64_t(y)) * std::uint64_t(width) +
            std::uint64_t(x);
        for (std::uint64_t left = row; left != 0; left &= left - 1) {
          keys.push_back(key + std::uint64_t(std::countr_zero(left)));
        }
        if (keys.size() > header.voxels) return no_index("has more voxels than it says");
      }
    }
  }
  if (keys.size() != header.voxels || sum.value() != checksum) {
    return no_index("is damaged: its checksum differs");
  }
  if (!decoder.is_at_end()) return no_index("has another end than its voxels");
  return keys;
}

}  // namespace

std::vector<std::byte> PlaceIndex::encode() const {
  const Eigen::Vector3i first = first_ + Eigen::Vector3i(kMargin, kMargin, 0);
  const Eigen::Vector3i extent = size_ - Eigen::Vector3i(2 * kMargin, 2 * kMargin, 0);
  Header header;
  header.first = {first.x(), first.y(), first.z()};
  header.extent = {extent.x(), extent.y(), extent.z()};
  for (const std::uint64_t word : bits_) header.voxels += std::uint64_t(std::popcount(word));
  Checksum sum = checksum_of(header);
  constexpr int shift = kMargin % kWidth;
  static_assert(shift != 0);
  BitEncoder encoder;
  VoxelRows rows(encoder, extent.y());
  for (int x = 0; x < extent.x(); x += kWidth) {
    const int word = (x + kMargin) / kWidth;
    rows.begin_strip();
    for (int z = 0; z < extent.z(); ++z) {
      rows.begin_layer();
      for (int y = 0; y < extent.y(); ++y) {
        const std::uint64_t* const words = row(y + kMargin, z) + word;
        sum.add(rows.code(y, std::min(kWidth, extent.x() - x),
                          words[0] >> shift | words[1] << (kWidth - shift)));
      }
    }
  }
  const std::uint64_t checksum = sum.value();
  const std::vector<std::byte> code = std::move(encoder).finish();
  std::vector<std::byte> bytes(sizeof(header) + sizeof(checksum) + code.size());
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::memcpy(bytes.data() + sizeof(header), &checksum, sizeof(checksum));
  std::ranges::copy(code, bytes.end() - std::ptrdiff_t(code.size()));
  return bytes;
}

Result<PlaceIndex> PlaceIndex::decode(std::span<const std::byte> bytes) {
  Header header;
  if (bytes.size() < sizeof(header)) return no_index("is cut off");
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (header.format != kPlacesFormat) return no_index("is of another version");
  const Eigen::Vector3i first(header.first[0], header.first[1], header.first[2]);
  const Eigen::Vector3i extent(header.extent[0], header.extent[1], header.extent[2]);
  if ((extent.array() < 1).any() || (extent.array() > kMostVoxels).any() ||
      (first.array() < -kFarthestVoxel).any() || (first.array() > kFarthestVoxel).any()) {
    return no_index("has an impossible size");
  }
  if (header.voxels == 0) return no_index("is empty");
  if (PlaceIndex(first, extent).memory() > most_memory(header.voxels)) {
    return no_index("claims a size that its voxels do not need");
  }
  bytes = bytes.subspan(sizeof(header));
  VANTAGE_TRY(const Keys keys, read_rows(header, bytes));
  return from(keys, first, extent);
}

}  // namespace vantage::voxel_search
