#include "view/picture.hpp"

#include <doctest/doctest.h>

using namespace vantage::view;

TEST_CASE("a size is two numbers with an x between them") {
  CHECK(parse_size("640x480") == Size{640, 480});
  for (const char* bad : {"", "640", "640x", "x480", "640x480x2", "640 x 480", "63x480", "640x8193",
                          "-640x480", "1e3x480", "99999999999x480"}) {
    CHECK_MESSAGE(!parse_size(bad), bad);
  }
}

TEST_CASE("scaling down takes the mean of what comes together") {
  const Picture large{{4, 2}, {0,  0, 0, 10, 0, 0, 1, 2, 3, 1, 2, 3,  //
                               20, 0, 0, 30, 0, 4, 1, 2, 3, 1, 2, 3}};
  const Picture small = scaled_down(large, 2);
  CHECK(small.size == Size{2, 1});
  CHECK(small.rgb == std::vector<std::uint8_t>{15, 0, 1, 1, 2, 3});
}

TEST_CASE("a picture becomes a PNG") {
  const auto png = to_png({{64, 64}, std::vector<std::uint8_t>(64 * 64 * 3, 7)});
  REQUIRE(png);
  CHECK(png->starts_with("\x89PNG"));
}
