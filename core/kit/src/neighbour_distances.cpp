#include "vantage/kit/neighbour_distances.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nanoflann.hpp>

#include "vantage/kit/kd_tree_points.hpp"

namespace vantage {
namespace {

using Points = KdTreePoints<Point>;
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>,
                                                 Points, 3, std::uint32_t>;
constexpr std::size_t kPointsALeaf = 16;

}  // namespace

std::vector<double> neighbour_distances(PointsView points, std::size_t neighbours) {
  std::vector<double> means(points.size(), 0.0);
  if (points.size() < 2) return means;
  const Points set{points};
  const Tree tree(3, set, nanoflann::KDTreeSingleIndexAdaptorParams(kPointsALeaf));
  const std::size_t found = std::min(neighbours, points.size() - 1);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size()), [&](const auto& range) {
    // One more, because the nearest of all is the point itself, or another one at its place.
    std::vector<std::uint32_t> which(found + 1);
    std::vector<double> squares(found + 1);
    for (std::size_t k = range.begin(); k != range.end(); ++k) {
      tree.knnSearch(points[k].data(), found + 1, which.data(), squares.data());
      double sum = 0.0;  // from near to far: of equally near points, any may have been found
      for (std::size_t i = 1; i <= found; ++i) sum += std::sqrt(squares[i]);
      means[k] = sum / static_cast<double>(found);
    }
  });
  return means;
}

}  // namespace vantage
