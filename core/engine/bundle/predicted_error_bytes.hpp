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
    to.number(at.expected);
    to.number(at.error);
    to.number(at.whole);
  }
}

inline std::vector<PredictedError> read_predicted_errors(ByteReader& from) {
  std::vector<PredictedError> errors;
  // Each is pushed when it was read: a forged number of them takes no memory.
  for (std::uint64_t left = from.counted(); left > 0 && from.ok(); --left) {
    PredictedError at{.place = from.point()};
    for (float PredictedError::*one :
         {&PredictedError::expected, &PredictedError::error, &PredictedError::whole}) {
      at.*one = from.number<float>();
      from.check(at.*one >= 0.0F);  // infinite where nothing holds the pose
    }
    errors.push_back(at);
  }
  return errors;
}

}  // namespace vantage
