#include "clustering.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nanoflann.hpp>
#include <numeric>
#include <queue>
#include <type_traits>
#include <utility>

#include "vantage/kit/kd_tree_points.hpp"

namespace vantage::visibility_clusters {
namespace {

using Eigen::Vector2d;

std::size_t common(const Voxels& a, const Voxels& b) {
  std::size_t count = 0;
  for (auto x = a.begin(), y = b.begin(); x != a.end() && y != b.end();) {
    if (*x == *y) ++count;
    const bool next_x = *x <= *y, next_y = *y <= *x;
    x += next_x;
    y += next_y;
  }
  return count;
}

using Places = KdTreePoints<Vector2d>;
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Places>,
                                                 Places, 2, std::uint32_t>;
using Within = nanoflann::RadiusResultSet<double, std::uint32_t>;
// Pairs before nanoflann 1.5, since then a structure of nanoflann.
using Found = std::remove_reference_t<decltype(std::declval<Within&>().m_indices_dists)>;

/// The distinct places of viewpoints in plan view: viewpoints may lie one above the other.
class Sites {
 public:
  explicit Sites(std::span<const Vector2d> viewpoints) : by_place_(viewpoints.size()) {
    const auto place = [&](std::uint32_t k) {
      return std::pair(viewpoints[k].y(), viewpoints[k].x());
    };
    std::iota(by_place_.begin(), by_place_.end(), std::uint32_t{0});
    std::ranges::sort(by_place_, {}, [&](std::uint32_t k) { return std::pair(place(k), k); });
    for (std::size_t n = 0; n < by_place_.size(); ++n) {
      if (n > 0 && place(by_place_[n]) == place(by_place_[n - 1])) continue;
      places_.push_back(viewpoints[by_place_[n]]);
      begin_.push_back(n);
    }
    begin_.push_back(by_place_.size());
  }

  [[nodiscard]] std::span<const Vector2d> places() const noexcept { return places_; }
  /// Ascending.
  [[nodiscard]] std::span<const std::uint32_t> viewpoints_at(std::uint32_t site) const {
    return std::span(by_place_).subspan(begin_[site], begin_[site + 1] - begin_[site]);
  }

 private:
  std::vector<std::uint32_t> by_place_;  // the viewpoints
  std::vector<Vector2d> places_;
  std::vector<std::size_t> begin_;  // of a place's viewpoints
};

/// Pairs every place with the `count` nearest, and with all that are as near as the last of them.
std::vector<Neighbours> neighbouring(std::span<const Vector2d> places, std::size_t count) {
  if (places.size() < 2) return {};
  const Places adaptor{places};
  const Tree tree(2, adaptor);
  const std::size_t k = std::min(count + 1, places.size());  // a place also finds itself
  std::vector<Neighbours> pairs;
  std::vector<std::uint32_t> indices(k);
  std::vector<double> squared(k);
  for (std::uint32_t here = 0; here < places.size(); ++here) {
    tree.knnSearch(places[here].data(), k, indices.data(), squared.data());
    // A search by radius finds everything nearer than the radius. A search by number depends on the
    // tree: of several equally near places, it finds any.
    const double radius = std::nextafter(squared.back(), std::numeric_limits<double>::infinity());
    Found found;
    Within within(radius, found);
    tree.findNeighbors(within, places[here].data(), {});
    for (const auto& [there, unused] : found) {
      if (there != here) pairs.emplace_back(std::min(here, there), std::max(here, there));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

class Grouping {
 public:
  Grouping(std::span<const Vector2d> places, std::span<const Voxels> seen,
           const GroupLimits& limits)
      : seen_(seen), limits_(limits), groups_(places.size()) {
    for (std::uint32_t k = 0; k < groups_.size(); ++k) {
      groups_[k] = {.members = {k},
                    .links = {},
                    .min = places[k],
                    .max = places[k],
                    .version = 0,
                    .joined_to = k};
    }
  }

  void connect(std::span<const Neighbours> neighbours) {
    std::vector<double> overlaps(neighbours.size());
    tbb::parallel_for(std::size_t{0}, neighbours.size(), [&](std::size_t k) {
      overlaps[k] = overlap(seen_[neighbours[k].first], seen_[neighbours[k].second]);
    });
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const auto [a, b] = neighbours[k];
      if (width(a, b) > limits_.max_width) continue;
      set_link(a, {b, overlaps[k]});
      set_link(b, {a, overlaps[k]});
      propose(a, {b, overlaps[k]});
    }
  }

  void join_all() {
    while (!queue_.empty()) {
      const Candidate best = queue_.top();
      queue_.pop();
      const bool current =
          groups_[best.a].version == best.version_a && groups_[best.b].version == best.version_b;
      if (current) join(best.a, best.b);
    }
  }

  [[nodiscard]] Groups groups() const {
    Groups out;
    out.of_viewpoint.resize(groups_.size());
    for (std::uint32_t k = 0; k < groups_.size(); ++k) {
      // A group joins one with a lower number, and that group's number is final by now.
      out.of_viewpoint[k] =
          groups_[k].joined_to == k ? out.count++ : out.of_viewpoint[groups_[k].joined_to];
    }
    return out;
  }

 private:
  /// A link to a neighbouring group: the sum of the overlaps of all pairs of a viewpoint in this
  /// group and one in the other.
  struct Link {
    std::uint32_t group;
    double sum;
  };
  struct Group {
    std::vector<std::uint32_t> members;
    std::vector<Link> links;  // by group
    Vector2d min, max;
    std::uint32_t version;    // counts changes of the group
    std::uint32_t joined_to;  // the group itself as long as it exists
  };
  struct Candidate {
    double overlap;
    std::uint32_t a, b, version_a, version_b;

    friend bool operator<(const Candidate& x, const Candidate& y) noexcept {  // y goes first
      if (x.overlap != y.overlap) return x.overlap < y.overlap;
      return std::pair(x.a, x.b) > std::pair(y.a, y.b);
    }
  };

  [[nodiscard]] double width(std::uint32_t a, std::uint32_t b) const {
    const Group &one = groups_[a], &other = groups_[b];
    return (one.max.cwiseMax(other.max) - one.min.cwiseMin(other.min)).maxCoeff();
  }

  [[nodiscard]] double sum_of_overlaps(std::uint32_t a, std::uint32_t b) const {
    const auto &here = groups_[a].members, &there = groups_[b].members;
    std::vector<double> sums(here.size());  // computed in parallel and then summed in order
    tbb::parallel_for(std::size_t{0}, here.size(), [&](std::size_t k) {
      for (const std::uint32_t other : there) sums[k] += overlap(seen_[here[k]], seen_[other]);
    });
    return std::accumulate(sums.begin(), sums.end(), 0.0);
  }

  void propose(std::uint32_t a, const Link& link) {
    const std::uint32_t b = link.group;
    const auto pairs = static_cast<double>(groups_[a].members.size() * groups_[b].members.size());
    const double mean = link.sum / pairs;
    if (mean < limits_.min_overlap) return;
    const auto [low, high] = std::minmax(a, b);
    queue_.push({mean, low, high, groups_[low].version, groups_[high].version});
  }

  void join(std::uint32_t a, std::uint32_t b) {
    std::vector<Link> links = joined_links(a, b);
    Group &into = groups_[a], &from = groups_[b];
    for (const std::uint32_t old : {a, b}) {
      for (const Link& link : groups_[old].links) {
        if (link.group != a && link.group != b) drop_link(link.group, old);
      }
    }
    into.members.insert(into.members.end(), from.members.begin(), from.members.end());
    into.min = into.min.cwiseMin(from.min);
    into.max = into.max.cwiseMax(from.max);
    into.links.clear();
    from.members = {};
    from.links = {};
    from.joined_to = a;
    ++from.version;
    ++into.version;
    for (const Link& link : links) {
      if (width(a, link.group) > limits_.max_width) continue;  // groups only grow
      set_link(a, link);
      set_link(link.group, {a, link.sum});
      propose(a, link);
    }
  }

  /// The links from a and b together to every neighbour of either.
  [[nodiscard]] std::vector<Link> joined_links(std::uint32_t a, std::uint32_t b) const {
    std::vector<Link> links;
    auto x = groups_[a].links.begin(), y = groups_[b].links.begin();
    const auto x_end = groups_[a].links.end(), y_end = groups_[b].links.end();
    while (x != x_end || y != y_end) {
      const bool of_a = y == y_end || (x != x_end && x->group <= y->group);
      const bool of_b = x == x_end || (y != y_end && y->group <= x->group);
      const std::uint32_t group = of_a ? x->group : y->group;
      if (group != a && group != b) {
        links.push_back({group, (of_a ? x->sum : sum_of_overlaps(a, group)) +
                                    (of_b ? y->sum : sum_of_overlaps(b, group))});
      }
      x += of_a;
      y += of_b;
    }
    return links;
  }

  void set_link(std::uint32_t from, const Link& link) {
    auto& links = groups_[from].links;
    links.insert(std::ranges::lower_bound(links, link.group, {}, &Link::group), link);
  }
  void drop_link(std::uint32_t from, std::uint32_t to) {
    std::erase_if(groups_[from].links, [&](const Link& link) { return link.group == to; });
  }

  std::span<const Voxels> seen_;
  GroupLimits limits_;
  std::vector<Group> groups_;
  std::priority_queue<Candidate> queue_;
};

}  // namespace

double overlap(const Voxels& a, const Voxels& b) {
  if (a.empty() && b.empty()) return 1.0;
  const std::size_t both = common(a, b);
  return static_cast<double>(both) / static_cast<double>(a.size() + b.size() - both);
}

std::vector<Neighbours> neighbours_of(std::span<const Vector2d> viewpoints, std::size_t count) {
  const Sites sites(viewpoints);
  std::vector<Neighbours> pairs;
  for (std::uint32_t site = 0; site < sites.places().size(); ++site) {
    const auto here = sites.viewpoints_at(site);
    for (std::size_t k = 0; k < here.size(); ++k) {
      for (const std::uint32_t other : here.subspan(k + 1)) {
        pairs.emplace_back(std::minmax(here[k], other));
      }
    }
  }
  for (const auto& [one, another] : neighbouring(sites.places(), count)) {
    for (const std::uint32_t here : sites.viewpoints_at(one)) {
      for (const std::uint32_t there : sites.viewpoints_at(another)) {
        pairs.emplace_back(std::minmax(here, there));
      }
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

Groups group(std::span<const Vector2d> places, std::span<const Voxels> seen,
             std::span<const Neighbours> neighbours, const GroupLimits& limits) {
  Grouping grouping(places, seen, limits);
  grouping.connect(neighbours);
  grouping.join_all();
  return grouping.groups();
}

}  // namespace vantage::visibility_clusters
