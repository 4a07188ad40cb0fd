#include "view/colors.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace vantage;
using namespace vantage::view;

namespace {

double luminance(const Color& c) {
  const auto linear = [](double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(c.x()) + 0.7152 * linear(c.y()) + 0.0722 * linear(c.z());
}

double hue_distance(double a, double b) {
  const double d = std::abs(a - b);
  return std::min(d, 1.0 - d);
}

}  // namespace

TEST_CASE("both colour maps grow lighter all the way") {
  for (const auto& map : {&viridis, &magma}) {
    for (int i = 1; i <= 100; ++i)
      CHECK(luminance(map(i / 100.0)) > luminance(map((i - 1) / 100.0)));
    CHECK(map(-1.0) == map(0.0));
    CHECK(map(2.0) == map(1.0));
  }
}

TEST_CASE("hues are about equally bright, and colours of a screen") {
  for (int i = 0; i < 24; ++i) {
    const Color color = hue_color(i / 24.0, 0.7);
    CHECK((color.array() >= 0.0).all());
    CHECK((color.array() <= 1.0).all());
    CHECK(luminance(color) == doctest::Approx(0.35).epsilon(0.25));
  }
}

TEST_CASE("neighbours on a grid are at least a fifth of the circle apart") {
  std::vector<Region> regions;
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y) {
      regions.push_back(
          {"r", HalfOpenBox{{10.0 * x, 10.0 * y}, {10.0 * x + 10, 10.0 * y + 10}}, {}});
    }
  }
  const auto hues = region_hues(regions);
  for (int i = 0; i < 64; ++i) {
    for (int j = 0; j < i; ++j) {
      if (std::abs(i / 8 - j / 8) > 1 || std::abs(i % 8 - j % 8) > 1) continue;
      CHECK(hue_distance(hues[static_cast<std::size_t>(i)], hues[static_cast<std::size_t>(j)]) >
            0.2);
    }
  }
}

TEST_CASE("a scale leaves strays out, and is never empty") {
  std::vector<double> values(1000, 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(i);
  values.push_back(1e6);
  const Range range = range_of(values);
  CHECK(range.low == 5.0);
  CHECK(range.high == 995.0);
  CHECK(range.share(500.0) == doctest::Approx(0.5));
  CHECK(range.share(1e6) == 1.0);
  const Range flat = range_of({3.0, 3.0});
  CHECK(flat.high > flat.low);
  CHECK(range_of({}).share(1.0) == 0.0);
}
