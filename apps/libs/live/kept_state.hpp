#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::live {

/// What a session leaves for the next.
struct KeptState {
  double stamp = 0.0;  ///< of the scan [s]
  Pose T_map_sensor;
};

/// Nothing if there is no such file. Errors: `corrupt_data` for anything else than such a state.
[[nodiscard]] Result<std::optional<KeptState>> read_state(const std::filesystem::path& file);
/// Errors: those of OutputFile.
[[nodiscard]] Result<void> write_state(const std::filesystem::path& file, const KeptState& state);

}  // namespace vantage::live
