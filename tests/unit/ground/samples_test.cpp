// What judges the filters, in tests/benchmarks.
#include <doctest/doctest.h>

#include <array>
#include <fstream>
#include <stdexcept>

#include "ground_samples.hpp"
#include "support/real_data.hpp"

namespace vantage::benchmarks {
namespace {

TEST_CASE("errors are shares of the ground, of the objects and of all points, and kappa") {
  // 4 of ground, 6 of objects; of the ground 3 are found, of the objects 2.
  const LabelledCloud cloud{PointCloud(10, Point::Zero()),
                            {true, true, true, true, false, false, false, false, false, false}};
  const GroundErrors errors = errors_of(cloud, {0, 1, 2, 4, 5});
  CHECK(errors.type_1 == doctest::Approx(25.0));
  CHECK(errors.type_2 == doctest::Approx(100.0 * 2 / 6));
  CHECK(errors.total == doctest::Approx(30.0));
  // agreement 0.7, by chance 0.4 * 0.5 + 0.6 * 0.5
  CHECK(errors.kappa == doctest::Approx(100.0 * (0.7 - 0.5) / 0.5));
  CHECK(errors_of(cloud, {0, 1, 2, 3}).total == 0.0);
  CHECK(errors_of(cloud, {0, 1, 2, 3}).kappa == doctest::Approx(100.0));
}

TEST_CASE("clouds side by side are as many points as asked for, apart, with their labels") {
  const std::array clouds{LabelledCloud{{{5.5, 7, 1}, {15.5, 9, 2}}, {true, false}},
                          LabelledCloud{{{-900, -3, 3}}, {true}}};
  const LabelledCloud all = side_by_side(clouds, 8);
  REQUIRE(all.points.size() == 9);
  CHECK(all.points[0] == Point(0.5, 0, 1));
  CHECK(all.points[1] == Point(10.5, 2, 2));
  CHECK(all.points[6] == Point(51, 0, 3));
  for (std::size_t k = 0; k < all.points.size(); ++k) {
    const std::size_t original = k < 6 ? k % 2 : 6;
    CHECK(all.is_ground[k] == (original != 1));
    CHECK((all.points[k] - all.points[original]).cwiseAbs().maxCoeff() <= 0.25);
    CHECK(all.points[k].z() == all.points[original].z());
  }
}

TEST_CASE("files that are no labelled clouds are refused") {
  const test::TemporaryFolder folder;
  const auto refused = [&](const std::string& content) {
    std::ofstream(folder.path() / "cloud.pcd", std::ios::binary) << content;
    CHECK_THROWS_AS((void)read_labelled(folder.path() / "cloud.pcd"), std::runtime_error);
  };
  refused("");
  refused("#\nFIELDS x y z intensity\nPOINTS 0\nDATA binary\n");
  refused("#\nFIELDS x y z\nPOINTS 2\nDATA binary\n0123456789ab");
  refused("#\nFIELDS x y z\nPOINTS 1\nDATA ascii\n0 0 0\n");
}

}  // namespace
}  // namespace vantage::benchmarks
