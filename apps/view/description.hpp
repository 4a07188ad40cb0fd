#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

#include "view/controls.hpp"
#include "view/scene.hpp"

namespace vantage::view {

/// A few lines about what is drawn.
[[nodiscard]] std::string description(const Scene& scene, const Drawing& drawing,
                                      const Controls& controls, const Scales& scales,
                                      std::size_t max_points);
/// The same for programs.
[[nodiscard]] nlohmann::ordered_json to_json(const Scene& scene, const Drawing& drawing,
                                             const Controls& controls, const Scales& scales);

}  // namespace vantage::view
