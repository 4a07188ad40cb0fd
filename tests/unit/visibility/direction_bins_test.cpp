#include <doctest/doctest.h>

#include <cstdint>
#include <numeric>
#include <vector>

#include "direction_bins.hpp"
#include "scenes.hpp"

namespace vantage::test {
namespace {

using hpr::DirectionBins;

// Anywhere, along the edges and through the corners of the cube, along the axes.
PointCloud directions() {
  PointCloud all = joined(sphere(20'000, 1.0), lattice(2, 0.5));
  std::erase(all, Point(0, 0, 0));
  for (const Point& p : ball(1, 500, 3.0)) {
    for (int axis = 0; axis < 3; ++axis) {
      Point on_edge = p;
      on_edge[(axis + 1) % 3] = on_edge[axis];
      all.push_back(on_edge);
      on_edge[(axis + 1) % 3] = -std::nextafter(on_edge[axis], 10.0);
      all.push_back(on_edge);
      all.push_back(1e-12 * on_edge);
      all.push_back(1e12 * p);
    }
  }
  return all;
}

TEST_CASE("DirectionBins: a direction is in one of the bins, whatever its length") {
  for (const std::uint32_t edge : {1U, 2U, 16U, 64U}) {
    const DirectionBins bins(edge);
    CHECK(bins.edge() == edge);
    CHECK(bins.size() == 6 * edge * edge);
    std::vector<int> hits(bins.size(), 0);
    std::size_t beyond = 0, moved = 0;
    for (const Point& p : directions()) {
      const std::uint32_t bin = bins.bin_of(p);
      if (bin >= bins.size()) {
        ++beyond;
        continue;
      }
      ++hits[bin];
      if (bins.bin_of(0x1p-40 * p) != bin || bins.bin_of(0x1p30 * p) != bin) ++moved;
    }
    CHECK(beyond == 0);
    CHECK(moved == 0);
    if (edge <= 16) CHECK(std::count(hits.begin(), hits.end(), 0) == 0);
  }
}

TEST_CASE("DirectionBins: coarser bins join fine ones, and each has its place among them") {
  const DirectionBins fine(64);
  for (const int shift : {0, 1, 2, 6}) {
    CAPTURE(shift);
    const DirectionBins coarse = fine.coarser(shift);
    CHECK(coarse.edge() == 64U >> shift);
    std::vector<int> taken(fine.size(), 0);
    for (std::uint32_t bin = 0; bin < fine.size(); ++bin) {
      const std::uint32_t joined = fine.coarser_bin(bin, shift);
      const std::uint32_t place = fine.place_in_coarser(bin, shift);
      REQUIRE(joined < coarse.size());
      REQUIRE(place < 1U << (2 * shift));
      ++taken[(joined << (2 * shift)) | place];
    }
    CHECK(std::count(taken.begin(), taken.end(), 1) == static_cast<std::ptrdiff_t>(fine.size()));
    std::size_t differ = 0;
    for (const Point& p : directions()) {
      if (coarse.bin_of(p) != fine.coarser_bin(fine.bin_of(p), shift)) ++differ;
    }
    CHECK(differ == 0);
  }
}

TEST_CASE("DirectionBins: a bin holds directions near each other, and so do the next ones") {
  const DirectionBins bins(16);
  std::vector<Eigen::Vector3d> sum(bins.size(), Eigen::Vector3d::Zero());
  const PointCloud all = sphere(200'000, 1.0);
  for (const Point& p : all) sum[bins.bin_of(p)] += p;
  for (Eigen::Vector3d& s : sum) s.normalize();
  std::size_t far = 0, jumps = 0;
  for (const Point& p : all) {
    if ((p - sum[bins.bin_of(p)]).norm() > 2.0 / 16) ++far;
  }
  for (std::uint32_t bin = 0; bin + 1 < bins.size(); ++bin) {
    if ((bin + 1) % 256 != 0 && (sum[bin + 1] - sum[bin]).norm() > 3.0 / 16) ++jumps;
  }
  CHECK(far == 0);
  CHECK(jumps == 0);
}

}  // namespace
}  // namespace vantage::test
