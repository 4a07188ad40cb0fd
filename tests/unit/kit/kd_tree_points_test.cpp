#include "vantage/kit/kd_tree_points.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <nanoflann.hpp>
#include <random>
#include <vector>

namespace vantage {
namespace {

template <class Vector>
void nearest_is_that_of_a_search_of_all() {
  constexpr int kDimensions = Vector::RowsAtCompileTime;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-5.0, 5.0);
  const auto any = [&] { return Vector(Vector::NullaryExpr([&] { return coordinate(random); })); };
  std::vector<Vector> points(300);
  for (Vector& p : points) p = any();
  const KdTreePoints<Vector> data{points};
  using Points = KdTreePoints<Vector>;
  const nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>, Points,
                                            kDimensions, std::uint32_t>
      tree(kDimensions, data);
  for (int n = 0; n < 100; ++n) {
    const Vector x = any();
    std::uint32_t found = 0;
    double squared = 0.0;
    tree.knnSearch(x.data(), 1, &found, &squared);
    for (const Vector& p : points)
      CHECK((p - x).squaredNorm() >= (points[found] - x).squaredNorm());
  }
}

TEST_CASE("a kd-tree reads borrowed points of two and of three coordinates") {
  nearest_is_that_of_a_search_of_all<Eigen::Vector2d>();
  nearest_is_that_of_a_search_of_all<Eigen::Vector3d>();
}

}  // namespace
}  // namespace vantage
