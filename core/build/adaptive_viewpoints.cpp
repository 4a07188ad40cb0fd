#include "build/adaptive_viewpoints.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "vantage/kit/index_set.hpp"

namespace vantage {
namespace {

constexpr int kWidest = 3;  // the widest spacing is 2^3 voxels

/// A square of 2^n voxels in plan view.
struct Square {
  std::int64_t y, x;
  friend auto operator<=>(const Square&, const Square&) = default;
  [[nodiscard]] Square of_size(int n) const { return {y >> n, x >> n}; }
};

/// All viewpoints over one voxel of the plan view.
struct Standpoint {
  Square voxel;
  PointCloud viewpoints;
};

struct Block {
  std::vector<Standpoint> places;  // places not asked yet
  std::vector<Square> asked;       // voxels of the places that were asked
};

std::vector<Block> blocks_of(std::span<const Point> viewpoints, double voxel_size) {
  std::map<Square, std::map<Square, PointCloud>> sorted;
  for (const Point& q : viewpoints) {
    const Square voxel{static_cast<std::int64_t>(std::floor(q.y() / voxel_size)),
                       static_cast<std::int64_t>(std::floor(q.x() / voxel_size))};
    sorted[voxel.of_size(kWidest)][voxel].push_back(q);
  }
  std::vector<Block> blocks;
  for (auto& [square, places] : sorted) {
    Block& block = blocks.emplace_back();
    for (auto& [voxel, over_it] : places) block.places.push_back({voxel, std::move(over_it)});
  }
  return blocks;
}

/// Takes from the block the places that bring its spacing to 2^n voxels. In each square of that
/// size, this is the place nearest to the middle (the first of equally near places), unless a place
/// in the square has been asked already.
PointCloud next_of(Block& block, int n) {
  std::map<Square, std::size_t> chosen;  // index in `places`
  const auto off_middle = [&](const Square& voxel) {
    const std::int64_t size = std::int64_t{1} << n;
    const auto off = [&](std::int64_t k) { return std::abs(2 * (k & (size - 1)) + 1 - size); };
    return off(voxel.y) + off(voxel.x);
  };
  for (std::size_t k = 0; k < block.places.size(); ++k) {
    const Square& voxel = block.places[k].voxel;
    const auto [at, is_new] = chosen.try_emplace(voxel.of_size(n), k);
    if (!is_new && off_middle(voxel) < off_middle(block.places[at->second].voxel)) at->second = k;
  }
  for (const Square& voxel : block.asked) chosen.erase(voxel.of_size(n));
  PointCloud viewpoints;
  for (const auto& [square, k] : chosen) {
    Standpoint& place = block.places[k];
    viewpoints.insert(viewpoints.end(), place.viewpoints.begin(), place.viewpoints.end());
    block.asked.push_back(place.voxel);
    place.viewpoints.clear();
  }
  std::erase_if(block.places, [](const Standpoint& place) { return place.viewpoints.empty(); });
  return viewpoints;
}

}  // namespace

Result<AdaptiveSight> see_adaptively(
    std::span<const Point> viewpoints, double voxel_size, double min_gain, std::size_t points,
    const std::function<Result<IndexList>(std::span<const Point>)>& seen_from,
    std::uint64_t enough) {
  std::vector<Block> blocks = blocks_of(viewpoints, voxel_size);
  AdaptiveSight sight;
  IndexSet before(points), now(points);  // seen at wider spacings; at this one, too
  for (int n = kWidest; n >= 0 && !blocks.empty(); --n) {
    std::vector<Result<bool>> shows_more(blocks.size(), true);
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
      const PointCloud asked = next_of(blocks[b], n);
      if (asked.empty()) return;  // a finer spacing may have more
      auto seen = seen_from(asked);
      if (!seen) {
        shows_more[b] = fail(std::move(seen).error());
        return;
      }
      const auto known = static_cast<std::size_t>(std::count_if(
          seen->begin(), seen->end(), [&](std::uint32_t k) { return before.contains(k); }));
      now.add(*seen);
      shows_more[b] = n == kWidest || static_cast<double>(seen->size() - known) >
                                          min_gain * static_cast<double>(seen->size());
    });
    std::vector<Block> going_on;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      VANTAGE_TRY(const bool more, std::move(shows_more[b]));
      if (more) {
        going_on.push_back(std::move(blocks[b]));
      } else {
        for (const Standpoint& place : blocks[b].places) sight.skipped += place.viewpoints.size();
      }
    }
    blocks = std::move(going_on);
    if (now.size() > enough) break;
    before = now;
  }
  sight.seen = now.ascending();
  return sight;
}

}  // namespace vantage
