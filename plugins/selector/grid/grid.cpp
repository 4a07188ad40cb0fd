#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <unordered_set>
#include <utility>
#include <vector>

#include "vantage/kit/hash.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace {

using Numbers = std::vector<std::uint32_t>;

constexpr double kCoarsest = 64.0, kFinest = 0.06;  // edges of the grids' cells [m]

std::uint64_t lot(const vantage::Point& at) {
  const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  return vantage::hash(0, bits(at.x()), bits(at.y()), bits(at.z()));
}

/// One element for each cell of a coarse grid, then for each cell of the next finer one that has
/// none, and so on. Elements that at least one scan touches come before the others.
struct Grid {
  static constexpr auto schema() { return std::tuple{}; }

  [[nodiscard]] vantage::Result<Numbers> order(const vantage::RegionElements& region,
                                               std::size_t most) const {
    std::vector<bool> touched(region.elements.size(), false);
    for (const auto& scan : region.scans) {
      for (const vantage::Pull& pull : scan) touched[pull.element] = true;
    }
    const auto middle = [&](std::uint32_t i) -> const vantage::Point& {
      return region.elements[i].middle;
    };
    Numbers left(region.elements.size()), chosen;
    std::iota(left.begin(), left.end(), 0U);
    std::ranges::sort(left, {}, [&](std::uint32_t i) { return lot(middle(i)); });
    const auto untouched =
        std::ranges::stable_partition(left, [&](std::uint32_t i) { return touched[i]; });
    const Numbers unseen(untouched.begin(), untouched.end());
    left.erase(untouched.begin(), untouched.end());
    for (Numbers some : {left, unseen}) {
      for (double edge = kCoarsest; edge > kFinest; edge *= 0.5) {
        std::unordered_set<std::array<double, 3>, vantage::CellHash> taken;
        const auto take = [&](std::uint32_t i) {
          const vantage::Point& at = middle(i);
          return taken
              .insert(
                  {std::floor(at.x() / edge), std::floor(at.y() / edge), std::floor(at.z() / edge)})
              .second;
        };
        for (const std::uint32_t i : chosen) take(i);
        Numbers later;
        for (const std::uint32_t i : some) (take(i) ? chosen : later).push_back(i);
        some = std::move(later);
      }
      chosen.insert(chosen.end(), some.begin(), some.end());
    }
    chosen.resize(std::min(most, chosen.size()));
    return chosen;
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Selector, vantage::SelectorOf<Grid>, "grid",
               "one element for each cell of a grid, to compare with");
