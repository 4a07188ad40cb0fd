#pragma once

#include <span>
#include <string_view>

/// The files of templates/, compiled in.
namespace vantage::templates {

struct File {
  std::string_view path;  ///< below templates/, without ".in"
  std::string_view text;
};
[[nodiscard]] std::span<const File> files();

}  // namespace vantage::templates
