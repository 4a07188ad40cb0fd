#include "support/bags/nav_sat_fix.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "io/ros/messages.hpp"
#include "ros_messages.hpp"

namespace vantage::io::ros {
namespace {

using namespace test;

TEST_CASE("NavSatFix in every encoding") {
  for (const auto layout : kLayouts) {
    const auto fix = parse_nav_sat_fix(nav_sat_fix({.seconds = 7, .status = 2}, layout),
                                       encoding_of(layout), kWhere);
    REQUIRE_MESSAGE(fix, to_string(fix.error()));
    CHECK(fix->header.stamp == 7.5);
    CHECK(fix->header.frame == "gnss");
    CHECK(fix->has_fix);
    CHECK(fix->position.latitude == 35.6586);
    CHECK(fix->position.longitude == 139.7454);
    CHECK(fix->position.altitude == 50.0);
    REQUIRE(fix->variances);
    CHECK(*fix->variances == std::array{4.0, 9.0, 16.0});
  }
}

TEST_CASE("NavSatFix: no fix, unknown covariance, NaN") {
  for (const auto layout : kLayouts) {
    for (const auto status : {std::int8_t{-1}, std::int8_t{-2}}) {
      const auto none = parse_nav_sat_fix(
          nav_sat_fix({.status = status, .latitude = std::nan(""), .covariance_type = 0}, layout),
          encoding_of(layout), kWhere);
      REQUIRE(none);
      CHECK_FALSE(none->has_fix);
      CHECK(std::isnan(none->position.latitude));
      CHECK_FALSE(none->variances);
    }
  }
}

TEST_CASE("NavSatFix: cut at any byte refused, flipped bits do no harm") {
  for (const auto layout : kLayouts) {
    const std::string whole = nav_sat_fix({}, layout);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const auto fix =
          parse_nav_sat_fix(std::string_view(whole).substr(0, size), encoding_of(layout), kWhere);
      REQUIRE_FALSE(fix);
      check_clear(fix.error(), ErrorCode::corrupt_data, "run.bag", "byte");
    }
    for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
      std::string flipped = whole;
      flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << bit % 8));
      const auto fix = parse_nav_sat_fix(flipped, encoding_of(layout), kWhere);
      if (!fix) check_clear(fix.error(), ErrorCode::corrupt_data, "run.bag", "");
    }
    const auto wrong =
        parse_nav_sat_fix(nav_sat_fix({.covariance_type = 4}, layout), encoding_of(layout), kWhere);
    REQUIRE_FALSE(wrong);
    check_clear(wrong.error(), ErrorCode::corrupt_data, "run.bag",
                "is position_covariance_type 4, expected 0 to 3");
  }
}

}  // namespace
}  // namespace vantage::io::ros
