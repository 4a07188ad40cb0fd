#include "indices.hpp"

#include <doctest/doctest.h>

#include <algorithm>

namespace vantage::conformance {

Labels labels_of(const IndexList& indices, std::size_t points) {
  Labels labels(points, 0);
  for (const std::uint32_t i : indices) {
    if (i < points) labels[i] = 1;
  }
  return labels;
}

Labels labels_before(const Labels& labels, const IndexList& order) {
  Labels before(labels.size(), 0);
  for (std::size_t i = 0; i < order.size(); ++i) before[order[i]] = labels[i];
  return before;
}

std::size_t differing(const Labels& a, const Labels& b) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.size(); ++i) n += a[i] != b[i] ? 1U : 0U;
  return n;
}

std::size_t count(const Labels& labels) {
  return static_cast<std::size_t>(std::count(labels.begin(), labels.end(), 1));
}

void check_ascending(const IndexList& indices, std::size_t points) {
  const auto beyond =
      std::count_if(indices.begin(), indices.end(), [&](std::uint32_t i) { return i >= points; });
  CHECK_MESSAGE(beyond == 0, beyond << " indices are beyond the " << points << " points");
  const auto at = std::adjacent_find(indices.begin(), indices.end(),
                                     [](std::uint32_t a, std::uint32_t b) { return a >= b; });
  if (at != indices.end()) {
    FAIL_CHECK("index " << *(at + 1) << " comes after " << *at);
  }
}

std::vector<PointCloud> degenerate_clouds() {
  const Point p(12.3, 45.6, 7.8);
  PointCloud line, column;
  for (int i = 0; i < 200; ++i) {
    line.push_back({0.5 * i, 30.0, 1.0});
    column.push_back({30.0, 40.0, 0.1 * i});
  }
  return {{p}, {p, p + Point(1e7, -1e7, 0.0)}, PointCloud(100, p), line, column};
}

std::vector<std::size_t> some_places(std::size_t n) { return {0, n / 2, n - 1}; }

}  // namespace vantage::conformance
