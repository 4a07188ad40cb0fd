// E: the contract of a Selector.
#include "vantage/selector.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "clauses.hpp"
#include "scenes.hpp"

namespace vantage::conformance {
namespace {

using Order = std::vector<std::uint32_t>;

/// A region with scans in which each sees about a third of the elements.
struct Region {
  std::vector<MapElement> elements;
  std::vector<std::vector<Pull>> scans;

  [[nodiscard]] RegionElements view() const { return {.elements = elements, .scans = scans}; }
};

/// What a surface with some normal at some place does to a pose, with a small bias.
Pull pull_of(Random& random, std::uint32_t element, const Point& at) {
  const Point n = (random.in({-1, -1, -1}, {1, 1, 1}) + Point(1e-3, 0, 0)).normalized();
  const Point m = at.cross(n);
  const std::array<double, 6> row{n.x(), n.y(), n.z(), m.x(), m.y(), m.z()};
  const double weight = random.uniform(10.0, 1000.0), bias = random.uniform(-0.05, 0.05);
  Pull pull{.element = element};
  for (std::size_t i = 0, k = 0; i < 6; ++i) {
    pull.gradient[i] = static_cast<float>(weight * bias * row[i]);
    for (std::size_t j = i; j < 6; ++j, ++k) {
      pull.hessian[k] = static_cast<float>(weight * row[i] * row[j] + (i == j ? 1e-3 : 0.0));
    }
  }
  return pull;
}

Region region_of(const Subject& subject, std::uint32_t variant, std::uint32_t elements = 200,
                 std::size_t scans = 6) {
  Random random(subject.seed() + variant);
  Region region;
  for (std::uint32_t i = 0; i < elements; ++i) {
    region.elements.push_back({.number = i,
                               .middle = random.in({-30, -30, 0}, {30, 30, 8}),
                               .points = 6 + static_cast<std::uint32_t>(random.below(500))});
  }
  for (std::size_t s = 0; s < scans; ++s) {
    auto& scan = region.scans.emplace_back();
    const Point sensor = random.in({-5, -5, 1}, {5, 5, 2});
    for (const MapElement& element : region.elements) {
      if (random.below(3) == 0) {
        scan.push_back(pull_of(random, element.number, element.middle - sensor));
      }
    }
  }
  return region;
}

Order order_by(const Selector& selector, const Region& region, std::size_t most) {
  auto order = selector.order(region.view(), most);
  if (!order) FAIL("nothing is ordered: " << to_string(order.error()));
  return *std::move(order);
}

void each_once(const Subject& subject) {
  const auto selector = subject.make<Selector>();
  const Region region = region_of(subject, 0);
  for (const std::size_t most : {std::size_t{1}, std::size_t{50}, std::size_t{200}}) {
    CAPTURE(most);
    Order order = order_by(*selector, region, most);
    CHECK(order.size() == most);
    std::ranges::sort(order);
    CHECK_MESSAGE(std::ranges::adjacent_find(order) == order.end(), "an element comes twice");
    CHECK_MESSAGE((order.empty() || order.back() < region.elements.size()),
                  "an element is named that the region does not have");
  }
}

void more_than_there_are(const Subject& subject) {
  const auto selector = subject.make<Selector>();
  const Region region = region_of(subject, 1, 40);
  CHECK(order_by(*selector, region, 1000).size() == region.elements.size());
}

void prefixes(const Subject& subject) {
  const auto selector = subject.make<Selector>();
  for (const std::uint32_t variant : {0U, 1U}) {
    const Region region = region_of(subject, variant);
    const Order all = order_by(*selector, region, region.elements.size());
    for (const std::size_t most : {std::size_t{7}, std::size_t{60}, std::size_t{150}}) {
      CAPTURE(most);
      const Order some = order_by(*selector, region, most);
      CHECK_MESSAGE(std::ranges::equal(some, std::span(all).first(std::min(most, all.size()))),
                    "a shorter order is not the beginning of a longer one");
    }
  }
}

void little_to_go_by(const Subject& subject) {
  const auto selector = subject.make<Selector>();
  const Region full = region_of(subject, 2, 30);
  Region unseen = full;
  unseen.scans.clear();
  Region blind = full;
  for (auto& scan : blind.scans) scan.clear();
  Region flat = full;  // what holds only the height
  for (auto& scan : flat.scans) {
    for (Pull& pull : scan) {
      const float up = pull.hessian[11];
      pull.hessian = {};
      pull.hessian[11] = up;
    }
  }
  const Region none;
  const std::array<std::pair<const char*, const Region*>, 4> cases{
      {{"no elements", &none},
       {"no scans", &unseen},
       {"scans that touch nothing", &blind},
       {"elements that do not hold the pose", &flat}}};
  for (const auto& [what, region] : cases) {
    CAPTURE(what);
    CHECK(order_by(*selector, *region, 0).empty());
    CHECK(order_by(*selector, *region, 20).size() ==
          std::min<std::size_t>(20, region->elements.size()));
  }
}

void only_the_region(const Subject& subject) {
  const auto selector = subject.make<Selector>();
  const Region first = region_of(subject, 0), second = region_of(subject, 1);
  const Order of_first = order_by(*subject.make<Selector>(), first, 100);
  const Order of_second = order_by(*subject.make<Selector>(), second, 100);
  for (const bool is_first : {true, true, false, true}) {
    CHECK(order_by(*selector, is_first ? first : second, 100) == (is_first ? of_first : of_second));
  }
}

void concurrent(const Subject& subject) {
  const auto selector = subject.make<Selector>();
  constexpr std::size_t kThreads = 4;
  std::vector<Region> regions;
  std::vector<Order> expected;
  for (std::uint32_t i = 0; i < kThreads; ++i) {
    regions.push_back(region_of(subject, i));
    expected.push_back(order_by(*selector, regions.back(), 100));
  }
  std::vector<Result<Order>> got(kThreads);
  at_once(kThreads, [&](std::size_t i) { got[i] = selector->order(regions[i].view(), 100); });
  for (std::size_t i = 0; i < kThreads; ++i) {
    REQUIRE_MESSAGE(got[i], to_string(got[i].error()));
    CHECK(*got[i] == expected[i]);
  }
}

void any_threads(const Subject& subject) {
  const Region region = region_of(subject, 0, 2000);
  const Order expected = order_by(*subject.make<Selector>(), region, 500);
  with_threads([&] { CHECK(order_by(*subject.make<Selector>(), region, 500) == expected); });
}

constexpr std::array kClauses{
    Clause{"E1", "as many elements as were asked for, each in range and named once", &each_once},
    Clause{"E2", "if more are asked for than there are, all of them", &more_than_there_are},
    Clause{"E3", "a shorter order is the beginning of a longer one", &prefixes},
    Clause{"E4",
           "no elements, no scans, scans that touch nothing, elements that do not hold the pose: "
           "an order all the same",
           &little_to_go_by},
    Clause{"E5", "the order depends only on the region, not on earlier calls", &only_the_region},
    Clause{"E6", "concurrent calls on one object agree with calls one by one", &concurrent},
    Clause{"E7", "1, 2 and 7 threads give the same result", &any_threads},
};

}  // namespace

template <>
std::span<const Clause> own_clauses<Selector>() {
  return kClauses;
}

}  // namespace vantage::conformance
