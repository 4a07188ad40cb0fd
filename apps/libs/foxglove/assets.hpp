#pragma once

#include <string_view>

namespace vantage::foxglove {

/// The content of a file of the page that was compiled in; empty for another name. The files are
/// those of apps/libs/browser/ and page/.
[[nodiscard]] std::string_view asset(std::string_view name) noexcept;

}  // namespace vantage::foxglove
