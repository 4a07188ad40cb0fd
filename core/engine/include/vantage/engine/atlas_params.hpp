#pragma once

#include <cstdint>
#include <tuple>

#include "vantage/params.hpp"

namespace vantage {

/// [atlas]: where `vantage assess` measures how well a sensor can be localized.
struct AtlasParams {
  std::uint32_t max_sites = 400;
  double site_spacing = 20.0;

  static constexpr auto schema() {
    return std::tuple{
        optional("max_sites", &AtlasParams::max_sites, "",
                 "the assessment measures at this many viewpoints at most; in a larger map, they "
                 "stand farther apart",
                 at_least(1)),
        optional("site_spacing", &AtlasParams::site_spacing, "m",
                 "one viewpoint is measured at in each square of this size", positive),
    };
  }
};

}  // namespace vantage
