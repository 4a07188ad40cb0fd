#include "place_index.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace vantage::voxel_search {
namespace {

constexpr double kGroundWithin = 8.0;  // [m]

/// The order of keys is z, y, x: voxels of a row follow each other.
std::uint64_t key_of(const Eigen::Vector3i& voxel, const Eigen::Vector3i& extent) {
  return (std::uint64_t(voxel.z()) * std::uint64_t(extent.y()) + std::uint64_t(voxel.y())) *
             std::uint64_t(extent.x()) +
         std::uint64_t(voxel.x());
}

Eigen::Array3d in_voxels(const Point& p) { return (p / PlaceIndex::kVoxel).array().floor(); }

/// The least of the values within `reach` along a line, for each place of the line.
std::vector<std::int16_t> least_within(const std::vector<std::int16_t>& line, int reach) {
  std::vector<std::int16_t> least(line.size(), PlaceIndex::kNothing);
  const int n = static_cast<int>(line.size());
  for (int i = 0; i < n; ++i) {
    for (int k = std::max(0, i - reach); k <= std::min(n - 1, i + reach); ++k) {
      least[std::size_t(i)] = std::min(least[std::size_t(i)], line[std::size_t(k)]);
    }
  }
  return least;
}

}  // namespace

std::uint64_t PlaceIndex::most_memory(std::uint64_t voxels) noexcept {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 30U, kAlways = std::uint64_t{64} << 20U;
  constexpr std::uint64_t kPerVoxel = 4096;  // a street takes a hundredth of that
  return voxels > (kMost - kAlways) / kPerVoxel ? kMost : kAlways + kPerVoxel * voxels;
}

PlaceIndex::PlaceIndex(const Eigen::Vector3i& first, const Eigen::Vector3i& extent)
    : first_(first - Eigen::Vector3i(kMargin, kMargin, 0)),
      size_(extent + Eigen::Vector3i(2 * kMargin, 2 * kMargin, 0)),
      words_(std::size_t(size_.x() + 63) / 64 + 3) {}

std::uint64_t PlaceIndex::memory() const noexcept {
  return sizeof(std::uint64_t) * words_in_layer() * std::uint64_t(size_.z()) +
         sizeof(std::int16_t) * std::uint64_t(size_.x()) * std::uint64_t(size_.y());
}

PlaceIndex PlaceIndex::from(const std::vector<std::uint64_t>& keys, const Eigen::Vector3i& first,
                            const Eigen::Vector3i& extent) {
  PlaceIndex index(first, extent);
  index.bits_.assign(index.words_in_layer() * std::size_t(extent.z()) + 3, 0);
  for (const std::uint64_t key : keys) {
    const auto x = std::size_t(key % std::uint64_t(extent.x())) + kMargin;
    const std::uint64_t rest = key / std::uint64_t(extent.x());
    const auto y = std::size_t(rest % std::uint64_t(extent.y())) + kMargin;
    const auto z = std::size_t(rest / std::uint64_t(extent.y()));
    index.bits_[(z * std::size_t(index.size_.y()) + y) * index.words_ + x / 64] |= std::uint64_t{1}
                                                                                   << (x % 64);
  }
  index.find_lowest();
  return index;
}

Result<PlaceIndex::Builder> PlaceIndex::Builder::over(const Bounds3& bounds) {
  const Eigen::Array3d low = in_voxels(bounds.min), high = in_voxels(bounds.max);
  if (((high - low) >= double(kMostVoxels)).any() || (low.abs() > kFarthestVoxel).any()) {
    return fail(ErrorCode::unsupported, "the map is longer than " +
                                            std::to_string(kMostVoxels * 3 / 2) +
                                            " m: too large for one index of places");
  }
  return Builder(low.cast<int>(), (high - low).cast<int>() + 1);
}

void PlaceIndex::Builder::add(const Point& p) {
  const std::uint64_t key =
      key_of((in_voxels(p) - first_.cast<double>().array()).cast<int>(), extent_);
  if (!keys_.empty() && keys_.back() == key) return;
  keys_.push_back(key);
  if (keys_.size() <= limit_) return;
  tidy();
  limit_ = std::max(limit_, 2 * keys_.size());
}

void PlaceIndex::Builder::add(PointsView points) {
  for (const Point& p : points) add(p);
}

void PlaceIndex::Builder::tidy() {
  std::sort(keys_.begin(), keys_.end());
  keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
}

Result<PlaceIndex> PlaceIndex::Builder::finish() && {
  tidy();
  if (PlaceIndex(first_, extent_).memory() > most_memory(keys_.size())) {
    return fail(ErrorCode::unsupported,
                "the map has " + std::to_string(keys_.size()) + " voxels in a box of " +
                    std::to_string(extent_.x()) + " x " + std::to_string(extent_.y()) + " x " +
                    std::to_string(extent_.z()) +
                    " of them: too large for one index of places; are there points far away?");
  }
  return from(keys_, first_, extent_);
}

Result<PlaceIndex> PlaceIndex::of(PointsView map) {
  VANTAGE_CHECK(check_points(map, "the map"));
  VANTAGE_TRY(Builder builder, Builder::over(bounds_of(map)));
  builder.add(map);
  return std::move(builder).finish();
}

void PlaceIndex::find_lowest() {
  const auto width = std::size_t(size_.x()), height = std::size_t(size_.y());
  lowest_.assign(width * height, kNothing);
  for (int z = size_.z() - 1; z >= 0; --z) {
    for (std::size_t y = 0; y < height; ++y) {
      const std::uint64_t* const words = row(int(y), z);
      for (std::size_t w = 0; w < words_; ++w) {
        for (std::uint64_t set = words[w]; set != 0; set &= set - 1) {
          lowest_[y * width + 64 * w + std::size_t(__builtin_ctzll(set))] = std::int16_t(z);
        }
      }
    }
  }
  const int reach = static_cast<int>(std::ceil(kGroundWithin / kVoxel));
  std::vector<std::int16_t> line(width);
  for (std::size_t y = 0; y < height; ++y) {
    std::copy_n(lowest_.begin() + std::ptrdiff_t(y * width), width, line.begin());
    std::ranges::copy(least_within(line, reach), lowest_.begin() + std::ptrdiff_t(y * width));
  }
  line.resize(height);
  for (std::size_t x = 0; x < width; ++x) {
    for (std::size_t y = 0; y < height; ++y) line[y] = lowest_[y * width + x];
    const std::vector<std::int16_t> least = least_within(line, reach);
    for (std::size_t y = 0; y < height; ++y) lowest_[y * width + x] = least[y];
  }
}

}  // namespace vantage::voxel_search
