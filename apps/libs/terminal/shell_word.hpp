#pragma once

#include <string>

namespace vantage::cli {

/// A word that the shell reads as this text, in quotes.
[[nodiscard]] std::string shell_quoted(const std::string& text);

/// The same for people to read: in quotes only if it needs them.
[[nodiscard]] std::string shell_word(const std::string& text);

}  // namespace vantage::cli
