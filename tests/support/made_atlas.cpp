#include "support/made_atlas.hpp"

#include <numbers>

namespace vantage::test {

Atlas made_atlas(const Point& first) {
  const auto at = [&](double x) -> Point { return first + Point(x, 0, 0); };
  const auto pose = [&](double x) { return pose_from_xyz_rpy(at(x), {0, 0, 0.3}); };
  Atlas atlas;
  atlas.matcher = {.plugin = "ndt", .params = "resolution = 1.0\n"};
  atlas.sites = {{.region = RegionId{0},
                  .position = at(0),
                  .precision = SitePrecision{.expected_error = 0.01,
                                             .sigma_strong = 0.006,
                                             .sigma_weak = 0.008,
                                             .weak_direction = 2.0,
                                             .basin = 3.0},
                  .alike = {}},
                 {.region = RegionId{0},
                  .position = at(10),
                  .precision = SitePrecision{.expected_error = 0.3,
                                             .sigma_strong = 0.02,
                                             .sigma_weak = 0.29,
                                             .weak_direction = std::numbers::pi / 6.0,
                                             .basin = 1.0},
                  .alike = {}},
                 {.region = RegionId{0},
                  .position = at(20),
                  .precision = SitePrecision{.expected_error = 5.5,
                                             .sigma_strong = 0.02,
                                             .sigma_weak = 0.03,
                                             .weak_direction = 0.0,
                                             .basin = 0.0},
                  .alike = {{.T_map_scan = pose(0), .likeness = 1.2},
                            {.T_map_scan = pose(25), .likeness = 0.7}}},
                 {.region = RegionId{0}, .position = at(30), .precision = {}, .alike = {}}};
  return atlas;
}

}  // namespace vantage::test
