#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/map_element.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A region as a selector sees it. Borrowed for one call.
struct RegionElements {
  /// Of the prepared map; `number` counts from 0 here.
  std::span<const MapElement> elements;
  /// What the elements do to the pose of each of some scans in and around the region, at the true
  /// pose. A scan's pulls are ascending by element; elements that do nothing are left out.
  std::span<const std::vector<Pull>> scans;
};

/// Decides which elements of a region's prepared map are worth their bytes.
/// Thread safety: `order` may run on one object from many threads at once.
class VANTAGE_API Selector {
 public:
  virtual ~Selector();

  /// The elements that are kept first, second, ...: the engine keeps as many as the budget allows,
  /// so each prefix should be a good choice by itself. The result depends neither on the number of
  /// threads nor on earlier calls.
  /// @param most  no more than so many are needed
  /// @return      numbers of elements, each once; min(most, elements) of them
  [[nodiscard]] virtual Result<std::vector<std::uint32_t>> order(
      const RegionElements& region, std::size_t most) const noexcept = 0;
};

}  // namespace vantage
