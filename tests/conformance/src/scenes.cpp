#include "scenes.hpp"

#include <doctest/doctest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <numeric>
#include <utility>

namespace vantage::conformance {

IndexList Random::order(std::size_t n) {
  IndexList order(n);
  std::iota(order.begin(), order.end(), 0U);
  for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[below(i)]);
  return order;
}

PointCloud random_cloud(Random& random, std::size_t n, const Point& min, const Point& max) {
  PointCloud cloud;
  for (std::size_t i = 0; i < n; ++i) cloud.push_back(random.in(min, max));
  return cloud;
}

PointCloud lattice(double step, int n, const Point& offset) {
  PointCloud cloud;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) cloud.push_back(offset + Point(i * step, j * step, 0.0));
  }
  return cloud;
}

PointCloud moved(PointsView points, const Point& by) {
  PointCloud cloud;
  for (const Point& p : points) cloud.push_back(p + by);
  return cloud;
}

Pose moved(const Pose& pose, const Point& by) { return {pose.rotation, pose.translation + by}; }

PointCloud in_order(PointsView points, const IndexList& order) {
  PointCloud cloud;
  for (const std::uint32_t i : order) cloud.push_back(points[i]);
  return cloud;
}

void with_threads(const std::function<void()>& work) {
  for (const int n : {1, 2, 7}) {
    CAPTURE(n);
    const tbb::global_control most(tbb::global_control::max_allowed_parallelism,
                                   static_cast<std::size_t>(n));
    tbb::task_arena(n).execute(work);
  }
}

void at_once(std::size_t n, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> waiting{n};
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < n; ++i) {
    threads.emplace_back([&, i] {
      --waiting;
      while (waiting > 0) std::this_thread::yield();
      work(i);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace vantage::conformance
