#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/engine/predicted_errors.hpp"
#include "vantage/kit/byte_io.hpp"

namespace vantage {

inline void write(ByteWriter& to, std::span<const PredictedError> errors) {
  to.counted(errors.size());
  for (const PredictedError& at : errors) {
    to.point(at.place);
    to.number(at.error);
    to.number(at.whole);
  }
}

inline std::vector<PredictedError> read_predicted_errors(ByteReader& from) {
  std::vector<PredictedError> errors;
  // Each is pushed when it was read: a forged number of them takes no memory.
  for (std::uint64_t left = from.counted(); left > 0 && from.ok(); --left) {
    PredictedError at{.place = from.point()};
    at.error = from.number<float>();
    at.whole = from.number<float>();
    from.check(at.error >= 0.0F && at.whole >= 0.0F);  // infinite where nothing holds the pose
    errors.push_back(at);
  }
  return errors;
}

}  // namespace vantage
