#pragma once

#include <cstdint>

#include "vantage/engine/predicted_errors.hpp"
#include "vantage/kit/byte_io.hpp"

namespace vantage {

/// The predicted errors of a region. Each is added when it is read: a forged number of them takes
/// no memory.
template <class Archive, class Errors>
void describe_errors(Archive& archive, Errors& errors) {
  std::uint64_t size = errors.size();
  archive.counted(size);
  for (std::uint64_t k = 0; k < size && archive.ok(); ++k) {
    if constexpr (Archive::kReads) errors.emplace_back();
    auto& at = errors[k];
    archive.field(at.place);
    for (auto* one : {&at.expected, &at.error, &at.whole}) {
      archive.field(*one);
      archive.check(*one >= 0.0F);  // infinite where nothing holds the pose
    }
  }
}

}  // namespace vantage
