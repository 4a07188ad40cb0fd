// What the selector `contribution` adds to the contract of a selector.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "support/plugins.hpp"
#include "vantage/selector.hpp"

using namespace vantage;

namespace {

/// Scans that each see all elements. An element with an even number fixes the pose, another one
/// hardly.
struct HalfUseful {
  std::vector<MapElement> elements;
  std::vector<std::vector<Pull>> scans;

  HalfUseful() : scans(5) {
    constexpr std::array<std::size_t, 6> kDiagonal{0, 6, 11, 15, 18, 20};
    for (std::uint32_t i = 0; i < 60; ++i) {
      elements.push_back({.number = i, .middle = Point(i, 0.0, 0.0), .points = 10});
      Pull pull{.element = i};
      for (const std::size_t k : kDiagonal) {
        pull.hessian[k] = (i % 2 == 0 ? 500.0F : 1e-3F) * (k < 15 ? 1.0F : 100.0F);
      }
      for (auto& scan : scans) scan.push_back(pull);
    }
  }
};

std::string numbers(double noise, double power) {
  return "noise = " + std::to_string(noise) + "\npower = " + std::to_string(power);
}

}  // namespace

TEST_CASE("contribution tells useful elements from others at the ends of its parameters") {
  const HalfUseful region;
  for (const double noise : {1e-3, 0.1, 1e3}) {
    for (const double power : {0.05, 0.5, 4.0}) {
      CAPTURE(noise);
      CAPTURE(power);
      const auto selector = test::plugin<Selector>("contribution", numbers(noise, power));
      const auto order =
          selector->order({.elements = region.elements, .scans = region.scans}, 15).value();
      REQUIRE(order.size() == 15);
      CHECK(std::ranges::all_of(order, [](std::uint32_t i) { return i % 2 == 0; }));
    }
  }
}

TEST_CASE("contribution refuses parameters with which its choice would be a random one") {
  for (const std::string params : {"power = 0.04", "power = 4.1", "power = 1e-30", "power = inf",
                                   "noise = 9e-4", "noise = 1.1e3", "noise = 1e-40"}) {
    CAPTURE(params);
    CHECK_THROWS((void)test::plugin<Selector>("contribution", params));
  }
}
