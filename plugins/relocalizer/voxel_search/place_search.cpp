#include "place_search.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <mutex>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "vantage/kit/evenly_picked.hpp"

namespace vantage::voxel_search {
namespace {

constexpr double kVoxel = PlaceIndex::kVoxel;
constexpr int kHeadings = 72;
constexpr std::size_t kPoints = 200;  // of the scan; fewer than 256, the counters have eight bits
// After so many points, many blocks are out of the question.
constexpr std::array<std::size_t, 3> kDecided{96, 128, 160};
constexpr double kFarthest = 58.0;  // [m]
constexpr int kFarthestAround = 5;  // voxels, see contrast_at
// What is read around a place lies in the margin of the index.
static_assert(kFarthest / kVoxel + 1.0 + kFarthestAround <= PlaceIndex::kMargin);
// The blocks that are kept, of each heading and of all, and the voxels of those.
constexpr std::size_t kPerHeading = 600, kBlocks = 8000, kVoxels = 3000;
// Layers of the sensor above the lowest points around: up to 4.5 m.
constexpr int kLayersAbove = 2;
// Places nearer to each other than this are one.
constexpr double kApart = 3.0, kTurned = 0.2;

/// 128 blocks of a row.
using Bits = std::uint64_t __attribute__((vector_size(16)));
using Words = std::uint64_t __attribute__((vector_size(16), aligned(8)));

struct Try {
  int hits, x, y, z, heading;
};
bool better(const Try& a, const Try& b) {
  const auto order = [](const Try& t) { return std::tuple(-t.hits, t.heading, t.y, t.x, t.z); };
  return order(a) < order(b);
}

/// Keeps so many of the best, in any order.
void keep_best(std::vector<Try>& tries, std::size_t most) {
  if (tries.size() <= most) return;
  std::nth_element(tries.begin(), tries.begin() + std::ptrdiff_t(most), tries.end(), better);
  tries.resize(most);
}

double yaw_of(int heading) { return 2.0 * std::numbers::pi * heading / kHeadings; }

/// One point a voxel, at most kPoints of them, evenly picked.
PointCloud picked(PointsView scan) {
  std::set<std::array<int, 3>> taken;
  PointCloud all;
  for (const Point& p : scan) {
    if (!(p.head<2>().norm() < kFarthest)) continue;
    const Eigen::Array3i voxel = (p / kVoxel).array().floor().cast<int>();
    if (taken.insert({voxel.x(), voxel.y(), voxel.z()}).second) all.push_back(p);
  }
  return evenly_picked(all, kPoints);
}

/// Counts in 128 columns at once: bit i of the counters is in planes[i].
class Counters {
 public:
  void add(Bits a) {
    for (std::size_t i = 0; i < planes_.size(); ++i) carry(planes_[i], a);
  }
  void add(Bits a, Bits b, Bits c, Bits d, Bits e, Bits f, Bits g, Bits h) {
    const Bits two_a = sum(planes_[0], a, b), two_b = sum(planes_[0], c, d);
    const Bits two_c = sum(planes_[0], e, f), two_d = sum(planes_[0], g, h);
    const Bits four_a = sum(planes_[1], two_a, two_b), four_b = sum(planes_[1], two_c, two_d);
    Bits eight = sum(planes_[2], four_a, four_b);
    for (std::size_t i = 3; i < planes_.size(); ++i) carry(planes_[i], eight);
  }
  /// The columns that count at least `limit`, which is below 256.
  [[nodiscard]] Bits at_least(int limit) const {
    Bits more{}, equal = ~Bits{};
    for (std::size_t i = planes_.size(); i-- > 0;) {
      if ((limit >> i & 1) != 0) {
        equal &= planes_[i];
      } else {
        more |= equal & planes_[i];
        equal &= ~planes_[i];
      }
    }
    return more | equal;
  }
  [[nodiscard]] int count(std::size_t word, unsigned bit) const {
    int n = 0;
    for (std::size_t i = 0; i < planes_.size(); ++i) n |= int(planes_[i][word] >> bit & 1U) << i;
    return n;
  }

 private:
  static void carry(Bits& plane, Bits& a) {
    const Bits both = plane & a;
    plane ^= a;
    a = both;
  }
  /// plane += a + b; returns what is carried.
  static Bits sum(Bits& plane, Bits a, Bits b) {
    const Bits one = plane ^ a;
    const Bits carried = (plane & a) | (one & b);
    plane = one ^ b;
    return carried;
  }
  std::array<Bits, 8> planes_{};
};

/// The points of a scan, turned by a heading, as steps in voxels.
using Steps = std::vector<Eigen::Vector3i>;

Steps turned(const PointCloud& points, int heading) {
  const double c = std::cos(yaw_of(heading)), s = std::sin(yaw_of(heading));
  const auto whole = [](double metres) { return int(std::floor(metres / kVoxel + 0.5)); };
  Steps steps;
  steps.reserve(points.size());
  for (const Point& p : points) {
    steps.emplace_back(whole(c * p.x() - s * p.y()), whole(s * p.x() + c * p.y()), whole(p.z()));
  }
  return steps;
}

/// A turned point of the scan, as steps from the sensor's block.
struct Step {
  std::ptrdiff_t words;  // from the first word of the sensor's 128 blocks
  unsigned bit;
};

Bits bits_at(const std::uint64_t* base, const Step& step) {
  const std::uint64_t* const at = base + step.words;
  const Bits low = *reinterpret_cast<const Words*>(at);
  const Bits high = *reinterpret_cast<const Words*>(at + 1);
  return (low >> step.bit) | (high << 1U << (63U - step.bit));
}

/// The voxels of an area, first and last; none if the last is before the first.
struct Plan {
  Eigen::Vector2i first, last;

  [[nodiscard]] bool has(int x, int y) const {
    return x >= first.x() && x <= last.x() && y >= first.y() && y <= last.y();
  }
};
Plan plan_of(const PlaceIndex& index, const PlaceArea& area) {
  Plan plan;
  for (const int axis : {0, 1}) {
    const double low = PlaceIndex::kMargin, high = index.size()[axis] - PlaceIndex::kMargin - 1;
    const auto voxel = [&](double metres) {
      return std::floor((metres - index.origin()[axis]) / kVoxel);
    };
    plan.first[axis] = int(std::clamp(voxel(area.centre[axis] - area.radius), low, high + 1.0));
    plan.last[axis] = int(std::clamp(voxel(area.centre[axis] + area.radius), low - 1.0, high));
  }
  return plan;
}

/// All translations by whole blocks with one heading. A block at even steps along each axis has at
/// least the hits of each of its voxels.
class Turned {
 public:
  Turned(const PlaceIndex& index, const Steps& steps, const Plan& plan, int heading)
      : index_(index), heading_(heading), steps_(steps), plan_(plan) {
    limit_ = int(steps.size() / 4);
    by_layer_.resize(std::size_t(index.size().z() + kLayersAbove));
  }

  struct Best {
    std::vector<Try> tries;
    std::uint64_t words = 0;
  };
  [[nodiscard]] Best best(const std::stop_token& stop) && {
    if (plan_.last.x() < plan_.first.x()) return {};
    const int words = plan_.last.x() / 128;
    for (int word = plan_.first.x() / 128; word <= words && !stop.stop_requested(); word += 2) {
      for (int y = plan_.first.y() / 2 * 2; y <= plan_.last.y(); y += 2) try_at(word, y);
    }
    keep_best(tries_, kPerHeading);
    return {std::move(tries_), work_};
  }

 private:
  /// @param word  of 64 blocks
  void try_at(int word, int y) {
    int lowest = PlaceIndex::kNothing, highest = -1;
    const int end = std::min(128 * word + 256, index_.size().x());
    for (int x = 128 * word; x < end; x += 3) {
      const int low = index_.lowest(x, y);
      if (low == PlaceIndex::kNothing) continue;
      lowest = std::min(lowest, low);
      highest = std::max(highest, low);
    }
    for (int z = lowest; z <= highest + kLayersAbove && highest >= 0; z += 2) try_at(word, y, z);
  }

  void try_at(int word, int y, int z) {
    const std::vector<Step>& here = steps_in(z);
    const auto points = int(here.size());
    if (points < limit_) return;
    const std::uint64_t* const base =
        index_.blocks(0, 0, 0) + std::ptrdiff_t(index_.words_in_blocks()) * y + word;
    Counters counters;
    std::size_t k = 0;
    const auto add = [&](std::size_t to) {
      for (; k + 8 <= to; k += 8) {
        const Step* const s = here.data() + k;
        counters.add(bits_at(base, s[0]), bits_at(base, s[1]), bits_at(base, s[2]),
                     bits_at(base, s[3]), bits_at(base, s[4]), bits_at(base, s[5]),
                     bits_at(base, s[6]), bits_at(base, s[7]));
      }
    };
    for (const std::size_t decided : kDecided) {
      if (decided >= here.size()) break;
      add(decided);
      const Bits may = counters.at_least(std::max(0, limit_ - (points - int(k))));
      if ((may[0] | may[1]) != 0) continue;
      work_ += k;
      return;
    }
    work_ += here.size();
    add(here.size());
    for (; k < here.size(); ++k) counters.add(bits_at(base, here[k]));
    const Bits found = counters.at_least(limit_);
    for (const std::size_t half : {0U, 1U}) {
      for (std::uint64_t set = found[half]; set != 0; set &= set - 1) {
        const auto bit = unsigned(__builtin_ctzll(set));
        const int x = 2 * (64 * (word + int(half)) + int(bit));
        if (x + 1 < plan_.first.x() || x > plan_.last.x()) continue;
        tries_.push_back({counters.count(half, bit), x, y, z, heading_});
      }
    }
    if (tries_.size() >= 4 * kPerHeading) {
      std::nth_element(tries_.begin(), tries_.begin() + kPerHeading, tries_.end(), better);
      limit_ = std::max(limit_, tries_[kPerHeading].hits);
      tries_.resize(kPerHeading);
    }
  }

  /// The steps of the points that stay in the index if the sensor is in a layer or the one above.
  const std::vector<Step>& steps_in(int z) {
    std::vector<Step>& steps = by_layer_[std::size_t(z)];
    if (!steps.empty()) return steps;
    for (const Eigen::Vector3i& step : steps_) {
      if (z + step.z() < -1 || z + step.z() >= index_.size().z()) continue;
      const int at = std::max(0, z + step.z());  // also holds layer 0
      const int blocks = step.x() >> 1;
      const int words = blocks >> 6;
      steps.push_back({.words = std::ptrdiff_t(index_.first_of_blocks(step.x() & 1, 0, at)) +
                                std::ptrdiff_t(index_.words_in_blocks()) * step.y() + words,
                       .bit = unsigned(blocks - 64 * words)});
    }
    return steps;
  }

  const PlaceIndex& index_;
  int heading_;
  const Steps& steps_;
  Plan plan_;
  int limit_;  // tries with fewer hits are not among the best
  std::vector<std::vector<Step>> by_layer_;
  std::vector<Try> tries_;
  std::uint64_t work_ = 0;
};

/// How many points of a scan hit from each voxel of a block: x first, then y, then z.
std::array<int, 8> hits_in(const PlaceIndex& index, const Steps& steps, const Try& block) {
  std::array<int, 8> hits{};
  for (const Eigen::Vector3i& step : steps) {
    const int column = block.x + step.x(), bit = column & 63;
    for (const int up : {0, 1}) {
      const int layer = block.z + up + step.z();
      if (layer < 0 || layer >= index.size().z()) continue;
      for (const int beside : {0, 1}) {
        const std::uint64_t* const word =
            index.row(block.y + beside + step.y(), layer) + (column >> 6);
        const std::uint64_t two = bit < 63 ? word[0] >> bit : word[0] >> 63U | word[1] << 1U;
        const auto first = std::size_t(4 * up + 2 * beside);
        hits[first] += int(two & 1U);
        hits[first + 1] += int(two >> 1U & 1U);
      }
    }
  }
  return hits;
}

/// Of each block, the voxel with the most hits, if they are enough.
std::vector<Try> voxels_of(std::vector<Try> blocks, const PlaceIndex& index,
                           const std::vector<Steps>& steps, const Plan& plan) {
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    const Try block = blocks[b];
    const Steps& turned = steps[std::size_t(block.heading)];
    const std::array<int, 8> hits = hits_in(index, turned, block);
    blocks[b].hits = -1;
    for (int k = 0; k < 8; ++k) {
      const Try voxel{.hits = hits[std::size_t(k)],
                      .x = block.x + (k & 1),
                      .y = block.y + (k >> 1 & 1),
                      .z = block.z + (k >> 2 & 1),
                      .heading = block.heading};
      const bool enough = voxel.hits >= int(turned.size() / 4) && plan.has(voxel.x, voxel.y);
      if (enough && better(voxel, blocks[b])) blocks[b] = voxel;
    }
  });
  std::erase_if(blocks, [](const Try& voxel) { return voxel.hits < 0; });
  return blocks;
}

/// The share of the points that hit, less that share 4 and 7 m around.
double contrast_at(const PlaceIndex& index, const Steps& steps, const Try& at) {
  constexpr std::array<std::array<int, 2>, 16> kAround{{{3, 0},
                                                        {2, 2},
                                                        {0, 3},
                                                        {-2, 2},
                                                        {-3, 0},
                                                        {-2, -2},
                                                        {0, -3},
                                                        {2, -2},
                                                        {5, 0},
                                                        {3, 3},
                                                        {0, 5},
                                                        {-3, 3},
                                                        {-5, 0},
                                                        {-3, -3},
                                                        {0, -5},
                                                        {3, -3}}};
  int around = 0;
  for (const Eigen::Vector3i& step : steps) {
    const int z = at.z + step.z();
    if (z < 0 || z >= index.size().z()) continue;
    const std::uint64_t* const row = index.row(at.y + step.y(), z);
    for (const auto& [dx, dy] : kAround) {
      const int x = at.x + step.x() + dx;
      around += int(row[std::ptrdiff_t(index.words_in_row()) * dy + (x >> 6)] >> (x & 63) & 1U);
    }
  }
  return (at.hits - around / double(kAround.size())) / double(steps.size());
}

std::vector<int> headings_in(const PlaceArea& area) {
  std::vector<int> headings;
  for (int h = 0; h < kHeadings; ++h) {
    const double off = std::remainder(yaw_of(h) - area.heading, 2.0 * std::numbers::pi);
    if (std::abs(off) <= area.heading_within + std::numbers::pi / kHeadings) headings.push_back(h);
  }
  return headings;
}

}  // namespace

PlacesFound find_places(const PlaceIndex& index, PointsView scan, const PlaceArea& area,
                        std::size_t most, const std::stop_token& stop) {
  const PointCloud points = picked(scan);
  if (points.empty()) return {};
  const std::vector<int> headings = headings_in(area);
  const Plan plan = plan_of(index, area);
  std::vector<Steps> steps(kHeadings);
  PlacesFound found;
  std::vector<Try> tries;
  std::mutex mutex;  // guards both
  tbb::parallel_for(std::size_t{0}, headings.size(), [&](std::size_t k) {
    const auto heading = std::size_t(headings[k]);
    steps[heading] = turned(points, headings[k]);
    const Turned::Best best = Turned(index, steps[heading], plan, headings[k]).best(stop);
    const std::scoped_lock lock(mutex);
    found.words += best.words;
    tries.insert(tries.end(), best.tries.begin(), best.tries.end());
    keep_best(tries, kBlocks);
  });
  std::sort(tries.begin(), tries.end(), better);
  // The voxels of a block take the time of six words for each point.
  found.words += 6 * tries.size() * points.size();
  tries = voxels_of(std::move(tries), index, steps, plan);
  std::sort(tries.begin(), tries.end(), better);

  // Of neighbours, the best.
  std::set<std::array<int, 3>> taken;
  std::erase_if(tries, [&](const Try& t) {
    return !taken.insert({t.x / 2, t.y / 2, t.heading / 2}).second;
  });
  if (tries.size() > kVoxels) tries.resize(kVoxels);
  std::vector<PoseCandidate> weighed(tries.size());
  tbb::parallel_for(std::size_t{0}, tries.size(), [&](std::size_t k) {
    const Try& t = tries[k];
    const Point at = index.origin() + kVoxel * (Point(t.x, t.y, t.z) + Point::Constant(0.5));
    weighed[k].T_map_scan = pose_from_xyz_rpy(at, {0.0, 0.0, yaw_of(t.heading)});
    weighed[k].score = contrast_at(index, steps[std::size_t(t.heading)], t);
  });
  std::ranges::stable_sort(weighed, std::greater(), &PoseCandidate::score);
  std::vector<PoseCandidate>& places = found.places;
  for (const PoseCandidate& place : weighed) {
    if (places.size() == most) break;
    const bool known = std::any_of(places.begin(), places.end(), [&](const PoseCandidate& other) {
      return (other.T_map_scan.translation - place.T_map_scan.translation).norm() < kApart &&
             rotation_between(other.T_map_scan, place.T_map_scan) < kTurned;
    });
    if (!known) places.push_back(place);
  }
  return found;
}

}  // namespace vantage::voxel_search
