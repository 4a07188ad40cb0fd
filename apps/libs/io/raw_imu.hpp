#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vantage/result.hpp"
#include "vantage/track/samples.hpp"

namespace vantage::io {

/// Inertial samples as a source has them: in its order, forces in its unit, nothing left out but
/// what it does not measure.
struct RawImu {
  std::vector<ImuSample> samples;
  std::uint64_t not_measured = 0;  ///< messages without one of the two quantities or a stamp
  std::string frame, stamp_rule;
  std::optional<Error> damage;  ///< at which the samples of a bag end
};

}  // namespace vantage::io
