#include <algorithm>
#include <cstdint>
#include <functional>
#include <numeric>
#include <vector>

#include "vantage/kit/plugin_of.hpp"

namespace {

/// Elements with the most map points first.
struct Fullest {
  static constexpr auto schema() { return std::tuple{}; }

  [[nodiscard]] vantage::Result<std::vector<std::uint32_t>> order(
      const vantage::RegionElements& region, std::size_t most) const {
    std::vector<std::uint32_t> order(region.elements.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, std::greater(),
                             [&](std::uint32_t i) { return region.elements[i].points; });
    order.resize(std::min(most, order.size()));
    return order;
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Selector, vantage::SelectorOf<Fullest>, "fullest",
               "elements with the most points first, to compare with");
