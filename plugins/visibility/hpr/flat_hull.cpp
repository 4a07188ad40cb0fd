#include "flat_hull.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "exact_sign.hpp"

namespace vantage::hpr {
namespace {

// The ends of a row of points on a line through the origin.
std::vector<std::size_t> ends_of_line(std::span<const Point> points) {
  Eigen::Index axis = 0;
  points.front().cwiseAbs().maxCoeff(&axis);
  double low = 0.0, high = 0.0;
  for (const Point& p : points) {
    low = std::min(low, p[axis]);
    high = std::max(high, p[axis]);
  }
  std::vector<std::size_t> ends;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i][axis] != 0.0 && (points[i][axis] == low || points[i][axis] == high)) {
      ends.push_back(i);
    }
  }
  return ends;
}

}  // namespace

std::vector<std::size_t> flat_hull_vertices(std::span<const Point> points) {
  if (points.empty()) return {};
  // Leaving out an axis keeps the other coordinates as they are; the plane must not be parallel to
  // that axis.
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Vector2d zero = Eigen::Vector2d::Zero(), a = without(axis, points.front());
    const bool edge_on = std::all_of(points.begin(), points.end(), [&](const Point& p) {
      return sign_of_turn(zero, a, without(axis, p)) == Sign::zero;
    });
    if (edge_on) continue;

    std::vector<Eigen::Vector2d> plane;
    plane.reserve(points.size() + 1);
    for (const Point& p : points) plane.push_back(without(axis, p));
    plane.push_back(zero);
    std::vector<std::size_t> order(plane.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto key = [&](std::size_t i) { return std::tuple(plane[i].x(), plane[i].y()); };
    std::sort(order.begin(), order.end(),
              [&](std::size_t i, std::size_t j) { return key(i) < key(j); });
    order.erase(std::unique(order.begin(), order.end(),
                            [&](std::size_t i, std::size_t j) { return plane[i] == plane[j]; }),
                order.end());
    std::vector<Eigen::Vector2d> corners;
    const auto half = [&](auto begin, auto end) {  // one half of the hull: the chain that turns
                                                   // left
      std::vector<std::size_t> chain;
      for (auto k = begin; k != end; ++k) {
        while (chain.size() >= 2 &&
               sign_of_turn(plane[chain[chain.size() - 2]], plane[chain.back()], plane[*k]) !=
                   Sign::positive) {
          chain.pop_back();
        }
        chain.push_back(*k);
      }
      for (const std::size_t i : chain) corners.push_back(plane[i]);
    };
    half(order.begin(), order.end());
    half(order.rbegin(), order.rend());
    const auto less = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
      return std::tuple(p.x(), p.y()) < std::tuple(q.x(), q.y());
    };
    std::sort(corners.begin(), corners.end(), less);
    std::vector<std::size_t> vertices;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (plane[i] != zero && std::binary_search(corners.begin(), corners.end(), plane[i], less)) {
        vertices.push_back(i);
      }
    }
    return vertices;
  }
  return ends_of_line(points);
}

}  // namespace vantage::hpr
