#include "sight.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "flat_hull.hpp"

namespace vantage::hpr {
namespace {

// A node that appears larger than this [rad] is looked into at once.
constexpr double kWide = 0.06;

// Occluders of earlier viewpoints are put into the hull by buckets of directions, as far as needed.
constexpr DirectionBins kBuckets(16);
constexpr int kFinerShift = 2;
constexpr DirectionBins kFineBins(16U << kFinerShift);

// The farthest occluders are all kept. Of the others, the nearest of each fine bin is kept, because
// a close point hides much.
constexpr std::size_t kFarOccluders = 32'768;

// Before the first viewpoint, one point of each node that appears this small [rad] must do.
constexpr double kSmall = 0.02;

}  // namespace

Sight::Sight(const PointOctree& octree, const Settings& settings)
    : octree_(octree), settings_(settings), turned_octree_(octree) {}

void Sight::look_from(const Point& viewpoint) {
  eye_ = Eye(viewpoint, settings_);
  const PointOctree::Node& root = octree_.nodes()[0];
  slack_ = kRounding *
           ((octree_.origin() - viewpoint).norm() + (root.max - root.min).cast<double>().norm());
  turned_octree_.look_from(eye_, slack_);
  occlusion_.clear();
  vertices_.clear();
  coincident_.clear();
  if (occluders_.empty()) occluders_ = representatives();
  sort_occluders();
}

// ---- nodes

Sighting Sight::sighting(const PointOctree::Node& node) const {
  return Sighting::of(node, octree_.origin(), eye_.viewpoint(), slack_);
}

// Depth first, the nearest child first, within range; `enter` is asked before a node is entered.
template <class Enter, class Visit>
void Sight::traverse(const Enter& enter, const Visit& visit_leaf) const {
  std::vector<std::pair<Index, Sighting>> stack{{0, sighting(octree_.nodes()[0])}};
  while (!stack.empty()) {
    const auto [at, s] = stack.back();
    stack.pop_back();
    if (s.nearest > settings_.max_range || !enter(at, s)) continue;
    const PointOctree::Node& node = octree_.nodes()[at];
    if (node.is_leaf()) {
      visit_leaf(at, s);
      continue;
    }
    const auto before = static_cast<std::ptrdiff_t>(stack.size());
    for (Index c = node.children_first; c < node.children_last; ++c) {
      stack.emplace_back(c, sighting(octree_.nodes()[c]));
    }
    std::sort(stack.begin() + before, stack.end(),
              [](const auto& x, const auto& y) { return x.second.nearest > y.second.nearest; });
  }
}

StarHull::Cone Sight::cone_of(const Sighting& s) const {
  const double sine = s.radius / s.distance;
  return {.axis = s.centre / s.distance,
          .sine = sine,
          .cosine = std::sqrt(1.0 - sine * sine),
          .length = eye_.turned_length(s.nearest) * (1.0 + kRounding)};
}

// Whether all points of a node are inside the hull.
bool Sight::surely_hidden(const Sighting& s) {
  if (!(s.radius < kWide * s.distance)) return false;
  const auto slack = Eigen::Vector3d::Constant(slack_);
  const auto answer =
      occlusion_.hides({.low = s.low - slack, .high = s.high + slack, .nearest = s.nearest},
                       [this](std::uint32_t tile) { fill_tile(tile); });
  if (answer == OcclusionMap::Answer::not_on_one_face) return hull_.surely_holds(cone_of(s));
  return answer == OcclusionMap::Answer::hidden;
}

// After this, what the earlier viewpoints give for a tile and around it is in the hull.
void Sight::fill_tile(std::uint32_t tile) {
  for (int row = -1; row <= 1; ++row) {
    for (int column = -1; column <= 1; ++column) {
      put_in_bucket(kBuckets.bin_of(OcclusionMap::direction_beside(tile, column, row)));
    }
  }
  occlusion_.fill(tile, eye_, hull_);
}

// ---- occluders

// One point of each node that appears small, and of each leaf that does not.
std::vector<PointRef> Sight::representatives() const {
  std::vector<PointRef> refs;
  const auto first_of = [&](Index at, const Sighting&) {
    while (!octree_.nodes()[at].is_leaf()) at = octree_.nodes()[at].children_first;
    refs.push_back({octree_.nodes()[at].first, at});
  };
  traverse(
      [&](Index at, const Sighting& s) {
        if (!(s.radius < kSmall * s.distance)) return true;
        first_of(at, s);
        return false;
      },
      first_of);
  return refs;
}

std::vector<PointRef> Sight::participants() const {
  std::vector<PointRef> refs;
  traverse([](Index, const Sighting&) { return true; },
           [&](Index leaf, const Sighting&) {
             const PointOctree::Node& node = octree_.nodes()[leaf];
             for (Index k = node.first; k < node.last; ++k) {
               if (eye_.takes_part(eye_.relative(octree_.points()[k]).squaredNorm())) {
                 refs.push_back({k, leaf});
               }
             }
           });
  return refs;
}

// Thins the occluders and sorts them, bucket by bucket and mostly from neighbour to neighbour.
void Sight::sort_occluders() {
  struct Entry {
    PointRef ref;
    std::uint32_t bin;  // the fine bins of a bucket have consecutive numbers
    double squared;
  };
  std::vector<Entry> entries;
  entries.reserve(occluders_.size());
  for (const PointRef& ref : occluders_) {
    const Point p = eye_.relative(octree_.points()[ref.position]);
    const double squared = p.squaredNorm();
    if (!eye_.takes_part(squared)) continue;
    const std::uint32_t fine = kFineBins.bin_of(p);
    entries.push_back({ref,
                       (kFineBins.coarser_bin(fine, kFinerShift) << (2 * kFinerShift)) |
                           kFineBins.place_in_coarser(fine, kFinerShift),
                       squared});
  }
  double far = 0.0;
  if (entries.size() > kFarOccluders) {
    const auto middle = entries.end() - kFarOccluders;
    std::nth_element(entries.begin(), middle, entries.end(),
                     [](const Entry& a, const Entry& b) { return a.squared < b.squared; });
    far = middle->squared;
  }
  std::vector<double> nearest(kFineBins.size(), std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> first(kFineBins.size() + 1, 0);
  for (const Entry& e : entries) nearest[e.bin] = std::min(nearest[e.bin], e.squared);
  std::erase_if(entries,
                [&](const Entry& e) { return e.squared < far && e.squared > nearest[e.bin]; });
  for (const Entry& e : entries) ++first[e.bin + 1];
  for (std::size_t b = 0; b < kFineBins.size(); ++b) first[b + 1] += first[b];
  bucket_first_.resize(kBuckets.size() + 1);
  for (std::size_t b = 0; b <= kBuckets.size(); ++b)
    bucket_first_[b] = first[b << (2 * kFinerShift)];
  bucket_is_in_.assign(kBuckets.size(), 0);
  occluders_.resize(entries.size());
  for (const Entry& e : entries) occluders_[first[e.bin]++] = e.ref;
}

// Kept for the next viewpoint: what is on the hull, and what was not needed here.
void Sight::keep_occluders() {
  std::vector<PointRef> kept;
  for (const StarHull::Index v : hull_.vertices()) kept.push_back(vertices_[v]);
  for (std::size_t b = 0; b < kBuckets.size(); ++b) {
    if (bucket_is_in_[b] != 0) continue;
    kept.insert(kept.end(), occluders_.begin() + bucket_first_[b],
                occluders_.begin() + bucket_first_[b + 1]);
  }
  occluders_ = std::move(kept);
}

// ---- the hull

bool Sight::start_hull(const std::vector<PointRef>& among) {
  if (among.size() < 3) return false;
  const auto best = [&](const auto& measure) {
    return *std::max_element(among.begin(), among.end(), [&](const auto& i, const auto& j) {
      return measure(turned(i.position)) < measure(turned(j.position));
    });
  };
  const PointRef i = best([](const Point& p) { return p.squaredNorm(); });
  const Point a = turned(i.position);
  const PointRef j = best([&](const Point& p) { return a.cross(p).squaredNorm(); });
  const Point b = turned(j.position);
  const Eigen::Vector3d ab = a.cross(b);
  const PointRef k = best([&](const Point& p) { return std::abs(ab.dot(p)); });
  if (!hull_.start(a, b, turned(k.position))) return false;
  vertices_ = {PointRef{PointOctree::kNone, 0}, i, j, k};
  return true;
}

// Starts from a few of the occluders, wherever they are; otherwise from any three points that span
// space with the viewpoint. False if there are no such points.
bool Sight::start_hull() {
  std::vector<PointRef> few;
  const std::size_t step = 1 + occluders_.size() / 256;
  for (std::size_t k = 0; k < occluders_.size(); k += step) few.push_back(occluders_[k]);
  bool started = start_hull(few);
  if (!started) {
    const std::vector<PointRef> all = participants();
    started = start_hull(all);
    for (std::size_t j = 1; !started && j < all.size(); ++j) {
      // Rounding hid the span, or there is none: the second point must span a plane with the first.
      const Point a = turned(all[0].position), b = turned(all[j].position);
      bool plane = false;
      for (int axis = 0; axis < 3 && !plane; ++axis) {
        plane = sign_of_triple(a, b, Eigen::Vector3d::Unit(axis)) != Sign::zero;
      }
      if (!plane) continue;
      for (std::size_t k = j + 1; !started && k < all.size(); ++k) {
        started = hull_.start(a, b, turned(all[k].position));
        if (started) vertices_ = {PointRef{PointOctree::kNone, 0}, all[0], all[j], all[k]};
      }
      break;
    }
  }
  if (!started) return false;
  for (const PointRef& ref : few) put_in(ref, turned(ref.position));
  return true;
}

StarHull::Location Sight::put_in(const PointRef& ref, const Point& turned) {
  const StarHull::Location location = hull_.locate(turned);
  if (location.place == StarHull::Place::outside) {
    hull_.add(turned, location);
    vertices_.push_back(ref);
    occlusion_.hull_grew_in(OcclusionMap::kTiles.bin_of(turned));
  }
  return location;
}

void Sight::put_in_bucket(std::uint32_t bucket) {
  if (bucket_is_in_[bucket] != 0) return;
  bucket_is_in_[bucket] = 1;
  for (std::uint32_t k = bucket_first_[bucket]; k < bucket_first_[bucket + 1]; ++k) {
    put_in(occluders_[k], turned(occluders_[k].position));
  }
}

// ---- all that is visible

std::vector<PointRef> Sight::seen_refs(const Point& viewpoint) {
  look_from(viewpoint);
  if (!start_hull()) {
    const std::vector<PointRef> all = participants();
    PointCloud points;
    for (const PointRef& ref : all) points.push_back(turned(ref.position));
    // Also where the flip turns that place to the viewpoint, which is no vertex.
    if (std::ranges::all_of(points, [&](const Point& p) { return p == points[0]; })) return all;
    std::vector<PointRef> seen;
    for (const std::size_t i : flat_hull_vertices(points)) seen.push_back(all[i]);
    return seen;
  }
  for (std::uint32_t b = 0; b < kBuckets.size(); ++b) put_in_bucket(b);
  traverse([&](Index, const Sighting& s) { return !surely_hidden(s); },
           [&](Index leaf, const Sighting&) {
             for (const PointRef& ref : doubtful(leaf, [](Index) { return true; })) {
               const StarHull::Location location = put_in(ref, turned(ref.position));
               if (location.place == StarHull::Place::vertex &&
                   vertices_[location.at].position != ref.position) {
                 coincident_.emplace_back(ref, location.at);
               }
             }
           });
  std::vector<PointRef> seen;
  for (const StarHull::Index v : hull_.vertices()) seen.push_back(vertices_[v]);
  for (const auto& [ref, v] : coincident_) {
    if (hull_.is_on_hull(v)) seen.push_back(ref);
  }
  keep_occluders();
  return seen;
}

std::vector<Sight::Index> Sight::visible_from(const Point& viewpoint) {
  std::vector<Index> positions;
  for (const PointRef& ref : seen_refs(viewpoint)) positions.push_back(ref.position);
  return positions;
}

std::size_t Sight::mark_all_visible(const Point& viewpoint, UnknownPoints& unknown) {
  std::size_t marked = 0;
  for (const PointRef& ref : seen_refs(viewpoint)) {
    marked += unknown.mark_seen(ref.position, ref.leaf) ? 1 : 0;
  }
  return marked;
}

// ---- the visible among the unknown

std::size_t Sight::mark_visible(const Point& viewpoint, UnknownPoints& unknown) {
  if (!unknown.any_in(0)) return 0;
  look_from(viewpoint);
  if (!start_hull()) return mark_all_visible(viewpoint, unknown);
  std::size_t marked = 0;
  traverse(
      [&](Index at, const Sighting& s) {
        if (!unknown.any_in(at)) return false;
        if (!(s.radius < kWide * s.distance)) return true;
        return !surely_hidden(s);
      },
      [&](Index leaf, const Sighting&) {
        for (const PointRef& ref :
             doubtful(leaf, [&](Index position) { return unknown.holds(position); })) {
          if (is_visible(ref)) marked += unknown.mark_seen(ref.position, ref.leaf) ? 1 : 0;
        }
      });
  keep_occluders();
  return marked;
}

// The points of a leaf that the occlusion map does not show to be inside.
// @param wanted  says for each position whether it is wanted
template <class Wanted>
std::span<const PointRef> Sight::doubtful(Index leaf, const Wanted& wanted) {
  doubtful_.clear();
  const PointOctree::Node& node = octree_.nodes()[leaf];
  for (Index k = node.first; k < node.last; ++k) {
    if (!wanted(k)) continue;
    const Point p = eye_.relative(octree_.points()[k]);
    const double squared = p.squaredNorm();
    if (!eye_.takes_part(squared)) continue;
    if (!occlusion_.hides(p, squared, [this](std::uint32_t tile) { fill_tile(tile); })) {
      doubtful_.push_back({k, leaf});
    }
  }
  return doubtful_;
}

// Whether a point is a vertex of the hull of all points. The current hull has only few of them, and
// grows as the answer needs it. A point of the map that is above all others in the direction in
// which this point sticks out is a vertex of the hull of all points. If no point is above this one,
// this one is such a vertex.
bool Sight::is_visible(const PointRef& ref) {
  const Point relative = eye_.relative(octree_.points()[ref.position]);
  const Point p = eye_.turned(relative, relative.norm());
  while (true) {
    const StarHull::Location location = hull_.locate(p);
    if (location.place == StarHull::Place::inside) return false;
    const std::uint32_t bucket = kBuckets.bin_of(relative);
    if (bucket_is_in_[bucket] == 0) {
      put_in_bucket(bucket);
      continue;
    }
    const bool outside = location.place == StarHull::Place::outside;
    const Eigen::Vector3d direction =
        outside ? hull_.normal(location.at).normalized() : hull_.normal_at(location.at);
    const PointRef above = turned_octree_.support(direction, p, ref.leaf);
    if (above.position == PointOctree::kNone) {
      if (outside) {
        hull_.add(p, location);
        vertices_.push_back(ref);
        occlusion_.hull_grew_in(OcclusionMap::kTiles.bin_of(relative));
      }
      return true;
    }
    const StarHull::Location of_above = put_in(above, turned(above.position));
    if (of_above.place != StarHull::Place::outside) return is_vertex_among_all(ref, p);
  }
}

// The same if rounding leaves doubt: no point may be above any facet around this vertex.
bool Sight::is_vertex_among_all(const PointRef& ref, const Point& p) {
  const StarHull::Location location = put_in(ref, p);
  if (location.place == StarHull::Place::inside) return false;
  const StarHull::Index vertex = location.place == StarHull::Place::vertex
                                     ? location.at
                                     : static_cast<StarHull::Index>(vertices_.size() - 1);
  for (bool grown = true; grown;) {
    grown = false;
    const auto facets = hull_.facets_about(vertex);
    for (const StarHull::Index f : std::vector(facets.begin(), facets.end())) {
      const Eigen::Vector3d direction = hull_.normal(f).normalized();
      for (const PointRef& other : turned_octree_.as_far_as(direction, p)) {
        if (put_in(other, turned(other.position)).place == StarHull::Place::outside) grown = true;
      }
      if (!hull_.is_on_hull(vertex)) return false;
      if (grown) break;
    }
  }
  return true;
}

}  // namespace vantage::hpr
