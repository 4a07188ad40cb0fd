#include "vantage/kit/regions.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <limits>

namespace vantage {
namespace {

using Eigen::Vector2d;
using Part = PlanPart<double>;  // points by their x
using Halves = PlanHalves<double>;

TEST_CASE("a box that owns two corners ends one step beyond the greater") {
  const HalfOpenBox box = box_owning({-1.0, 0.0}, {2.0, 0.0});
  CHECK(contains(Footprint(box), Vector2d(-1.0, 0.0)));
  CHECK(contains(Footprint(box), Vector2d(2.0, 0.0)));
  CHECK_FALSE(contains(Footprint(box), box.max));
  CHECK(std::nextafter(box.max.x(), 0.0) == 2.0);
}

TEST_CASE("halves share the border, and each has the points on its side and a digit more") {
  std::vector<double> x{5.0, 1.0, 4.0, 2.0};
  const Part whole{{{0.0, 0.0}, {8.0, 1.0}}, x};
  const Halves halves = halves_of(whole, 0, 4.0, [](double p) { return p < 4.0; });
  CHECK(halves.below.box.max == Vector2d(4.0, 1.0));
  CHECK(halves.above.box.min == Vector2d(4.0, 0.0));
  CHECK(halves.below.points.size() == 2);
  CHECK(halves.above.points.size() == 2);
  CHECK(halves.below.label == "cell_0");
  CHECK(halves_of(halves.above, 0, 4.5, [](double p) { return p < 4.5; }).below.label == "cell_10");
}

TEST_CASE("a cut needs room for the narrowest piece on both sides") {
  const HalfOpenBox box{{0.0, 0.0}, {8.0, 1.0}};
  const auto room = room_for_cut(box, 0, 3.0);
  REQUIRE(room);
  CHECK(*room == std::pair(3.0, 5.0));
  CHECK_FALSE(room_for_cut(box, 1, 0.6));
}

TEST_CASE("the longer axis is tried first, the other one if that cannot be") {
  const auto tries = [](const Vector2d& size, Eigen::Index possible) {
    std::vector<Eigen::Index> tried;
    const auto at = across_longer(size, [&](Eigen::Index axis) {
      tried.push_back(axis);
      return axis == possible ? std::optional(axis) : std::nullopt;
    });
    CHECK(at == possible);
    return tried;
  };
  CHECK(tries({2.0, 1.0}, 0) == std::vector<Eigen::Index>{0});
  CHECK(tries({2.0, 1.0}, 1) == std::vector<Eigen::Index>{0, 1});
  CHECK(tries({1.0, 2.0}, 0) == std::vector<Eigen::Index>{1, 0});
  CHECK(tries({1.0, 1.0}, 0) == std::vector<Eigen::Index>{0});
}

TEST_CASE("parts are cut until none is to be cut, and come in the order of their labels") {
  std::vector<double> x{0.5, 1.5, 2.5, 3.5};
  const Part whole{box_owning({0.0, 0.0}, {4.0, 1.0}), x};
  const auto one_each = [](const Part& part) -> Result<std::optional<Halves>> {
    if (part.points.size() < 2) return std::nullopt;
    const double at = 0.5 * (part.box.min.x() + part.box.max.x());
    return halves_of(part, 0, at, [&](double p) { return p < at; });
  };
  const auto partition = cut_up<double>(whole, one_each, "a test");
  REQUIRE(partition);
  std::vector<std::string> labels;
  for (const Region& region : partition->regions()) labels.push_back(region.label);
  CHECK(labels == std::vector<std::string>{"cell_00", "cell_01", "cell_10", "cell_11"});

  const auto uncut = cut_up<double>(
      whole, [](const Part&) -> Result<std::optional<Halves>> { return std::nullopt; }, "a test");
  REQUIRE(uncut);
  CHECK(uncut->regions().front().label == "cell");
}

TEST_CASE("an error ends the cutting, and so do too many regions") {
  std::vector<double> x{0.5};
  const Part whole{box_owning({0.0, 0.0}, {1.0, 1.0}), x};
  const auto failing = cut_up<double>(
      whole,
      [](const Part&) -> Result<std::optional<Halves>> { return fail(ErrorCode::internal, "no"); },
      "a test");
  REQUIRE_FALSE(failing);
  CHECK(failing.error().message == "no");

  std::uint64_t parts = 0;
  const auto endless = cut_up<double>(
      whole,
      [&](const Part& part) -> Result<std::optional<Halves>> {
        if (++parts % 2 == 0) return std::nullopt;
        Halves halves{part, part};
        halves.below.label = halves.above.label = "same";
        return halves;
      },
      "max_points = 5");
  REQUIRE_FALSE(endless);
  CHECK(endless.error().code == ErrorCode::invalid_input);
  CHECK(endless.error().message == "max_points = 5 cuts the map into more than 1000000 regions");
}

}  // namespace
}  // namespace vantage
