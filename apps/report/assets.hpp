#pragma once

#include <string_view>

namespace vantage::report {

/// A file that was compiled in: "style.css", "page.js", "view3d.js", "three.min.js",
/// "OrbitControls.js". Precondition: it is one of these.
[[nodiscard]] std::string_view asset(std::string_view name) noexcept;

}  // namespace vantage::report
