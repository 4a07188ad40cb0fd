#include "image.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "optics.hpp"

namespace vantage::surface {
namespace {

constexpr float kOpaque = 60.0F;  // optical depth

/// The largest integer up to x. Precondition: -720 <= x < 2^24.
int floor_of(float x) noexcept {
  constexpr int kTurn = Image::kColumns;
  return static_cast<int>(x + static_cast<float>(kTurn)) - kTurn;
}

/// A bit for each of 64 bytes that are 0 or 1, the first the lowest.
std::uint64_t packed(const std::array<std::uint8_t, 64>& bytes) noexcept {
  static_assert(std::endian::native == std::endian::little);
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, &bytes[8 * k], sizeof eight);
    // Byte i goes to bit 56 + i, and nothing is carried there.
    bits |= (eight * 0x0102'0408'1020'4080U >> 56U) << 8 * k;
  }
  return bits;
}

/// The share of a size that an optical depth in front of it leaves.
float left_behind(float depth) noexcept { return std::pow(10.0F, -0.1F * lost_behind(depth)); }

}  // namespace

Image::Image() : depths_(static_cast<std::size_t>(kColumns) * kRows), hidden_(kWords * kRows) {
  clear();
}

void Image::clear() {
  std::fill(depths_.begin(), depths_.end(), 0.0F);
  std::fill(hidden_.begin(), hidden_.end(), 0);
  hides_all_ = std::numeric_limits<float>::infinity();
}

/// Calls visit(first pixel, its row and column, pixels, height, widths) for every row of pixels
/// that a footprint covers: of each pixel, height times width is the share that it covers.
template <class Visit>
void Image::for_rows(const Footprint& of, const Visit& visit) {
  const int first_row = std::max(0, floor_of(of.bottom));
  const int last_row = std::min(kRows - 1, floor_of(of.top));
  const int first = floor_of(of.left), last = floor_of(of.right);
  std::array<float, kColumns + 1>
      widths;  // NOLINT(cppcoreguidelines-pro-type-member-init): written below
  for (int column = first; column <= last; ++column) {
    const auto x = static_cast<float>(column);
    widths[static_cast<std::size_t>(column - first)] =
        std::min(x + 1.0F, of.right) - std::max(x, of.left);
  }
  for (int row = first_row; row <= last_row; ++row) {
    const auto y = static_cast<float>(row);
    const float height = std::min(y + 1.0F, of.top) - std::max(y, of.bottom);
    // In up to three pieces: before the first column, in the image, behind the last column.
    for (int begin = first; begin <= last;) {
      const int turn = begin < 0 ? kColumns : (begin >= kColumns ? -kColumns : 0);
      const int end = std::min(last, begin < 0 ? -1 : (begin < kColumns ? kColumns - 1 : last)) + 1;
      visit(static_cast<std::size_t>(row), static_cast<std::size_t>(begin + turn),
            static_cast<std::size_t>(end - begin), height,
            &widths[static_cast<std::size_t>(begin - first)]);
      begin = end;
    }
  }
}

float Image::passed(const Footprint& of) const {
  float sum = 0.0F, covered = 0.0F;
  for_rows(of, [&](std::size_t row, std::size_t column, std::size_t n, float height,
                   const float* widths) {
    const float* const depths = &depths_[row * kColumns + column];
    for (std::size_t k = 0; k < n; ++k) {
      const float share = height * widths[k], depth = depths[k];
      covered += share;
      if (depth == 0.0F) {
        sum += share;
      } else if (depth < kOpaque) {
        sum += share * std::exp(-depth);
      }
    }
  });
  // Around the viewpoint itself, in no direction.
  if (!(sum < covered)) return 1.0F;
  static const float least = left_behind(kOpaque);
  return sum > 0.0F ? left_behind(std::min(-std::log(sum / covered), kOpaque)) : least;
}

void Image::cast(const Footprint& of, float depth) {
  for_rows(of, [&](std::size_t row, std::size_t column, std::size_t n, float height,
                   const float* widths) {
    float* const depths = &depths_[row * kColumns + column];
    bool hides_all = false;
    for (std::size_t k = 0; k < n; ++k) {
      depths[k] += height * widths[k] * depth;
      hides_all |= depths[k] >= hides_all_;
    }
    if (!hides_all) return;
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t at = column + k;
      hidden_[row * kWords + at / 64] |= std::uint64_t{depths[k] >= hides_all_} << at % 64;
    }
  });
}

void Image::hide_behind(float depth, float bottom, float top) {
  hides_all_ = depth;
  const auto first = static_cast<std::size_t>(std::clamp(floor_of(bottom), 0, kRows));
  const auto end = static_cast<std::size_t>(std::clamp(floor_of(top) + 1, 0, kRows));
  for (std::size_t row = first; row < end; ++row) {
    const float* depths = &depths_[row * kColumns];
    for (std::size_t word = 0; word < kWords; ++word) {
      const std::size_t begin = 64 * word, bits = std::min<std::size_t>(64, kColumns - begin);
      std::array<std::uint8_t, 64> is_hidden{};
      for (std::size_t k = 0; k < bits; ++k) is_hidden[k] = depths[begin + k] >= depth ? 1 : 0;
      hidden_[row * kWords + word] = packed(is_hidden);
    }
  }
}

bool Image::hides(std::size_t row, int first, int last) const {
  const auto begin = static_cast<std::size_t>(first), end = static_cast<std::size_t>(last) + 1;
  for (std::size_t word = begin / 64; 64 * word < end; ++word) {
    std::uint64_t wanted = ~std::uint64_t{0};
    if (64 * word < begin) wanted &= ~std::uint64_t{0} << (begin - 64 * word);
    if (64 * (word + 1) > end) wanted &= ~std::uint64_t{0} >> (64 * (word + 1) - end);
    if ((hidden_[row * kWords + word] & wanted) != wanted) return false;
  }
  return true;
}

bool Image::hides(const Footprint& footprint) const {
  const int first_row = std::max(0, floor_of(footprint.bottom));
  const int last_row = std::min(kRows - 1, floor_of(footprint.top));
  const int first = floor_of(footprint.left), last = floor_of(footprint.right);
  if (first >= 0 && last < kColumns && first / 64 == last / 64) {  // most are in one word
    const std::uint64_t wanted = (~std::uint64_t{0} >> (63 - (last - first)))
                                 << static_cast<unsigned>(first % 64);
    const std::uint64_t* bits = &hidden_[static_cast<std::size_t>(first / 64)];
    for (int k = first_row; k <= last_row; ++k) {
      if (~bits[static_cast<std::size_t>(k) * kWords] & wanted) return false;
    }
    return true;
  }
  for (int k = first_row; k <= last_row; ++k) {
    const auto row = static_cast<std::size_t>(k);
    if (first < 0 && !hides(row, first + kColumns, kColumns - 1)) return false;
    if (last >= kColumns && !hides(row, 0, last - kColumns)) return false;
    if (!hides(row, std::max(first, 0), std::min(last, kColumns - 1))) return false;
  }
  return true;
}

}  // namespace vantage::surface
