#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "vantage/kit/hash.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace {

/// Elements that at least one scan touches, in random order, and the others after them.
struct Random {
  std::uint64_t seed = 1;
  static constexpr auto schema() {
    return std::tuple{
        vantage::optional("seed", &Random::seed, "", "another seed gives another order")};
  }

  [[nodiscard]] vantage::Result<std::vector<std::uint32_t>> order(
      const vantage::RegionElements& region, std::size_t most) const {
    std::vector<bool> touched(region.elements.size(), false);
    for (const auto& scan : region.scans) {
      for (const vantage::Pull& pull : scan) touched[pull.element] = true;
    }
    // The lot of an element depends on where it is, not on its number.
    const auto lot = [&](std::uint32_t i) {
      const vantage::Point& at = region.elements[i].middle;
      const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
      return std::pair(!touched[i], vantage::hash(seed, bits(at.x()), bits(at.y()), bits(at.z())));
    };
    std::vector<std::uint32_t> order(region.elements.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::sort(order, {}, lot);
    order.resize(std::min(most, order.size()));
    return order;
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Selector, vantage::SelectorOf<Random>, "random",
               "elements chosen at random, to compare with");
