#pragma once

#include <string>

namespace vantage::test {

/// The page without the content of its scripts and styles.
[[nodiscard]] std::string markup_of(const std::string& page);

/// Where elements are not closed in the order they were opened; empty if they all are.
[[nodiscard]] std::string imbalance(const std::string& markup);

/// What is not HTML in a markup that closes what it opens; empty if nothing is.
[[nodiscard]] std::string invalid_html(const std::string& markup);

}  // namespace vantage::test
