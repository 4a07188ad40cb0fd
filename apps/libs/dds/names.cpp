#include "dds/names.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace vantage::dds {

std::string name_of_type(std::string_view type, std::string_view kind, std::string_view part) {
  const std::size_t slash = std::min(type.find('/'), type.size());
  return fmt::format("{}::{}::dds_::{}{}_", type.substr(0, slash), kind,
                     type.substr(std::min(slash + 1, type.size())), part);
}

std::string type_of_name(std::string_view name) {
  for (const std::string_view middle : {"::msg::dds_::", "::srv::dds_::"}) {
    const std::size_t at = name.find(middle);
    if (at == std::string_view::npos || !name.ends_with('_')) continue;
    const std::string_view type = name.substr(at + middle.size());
    return fmt::format("{}/{}", name.substr(0, at), type.substr(0, type.size() - 1));
  }
  return std::string(name);
}

std::string name_of_topic(std::string_view topic) { return fmt::format("rt{}", topic); }

Result<void> check_name(std::string_view name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '/';
  };
  if (name.size() > 1 && name.front() == '/' && name.back() != '/' &&
      name.find("//") == std::string_view::npos && std::ranges::all_of(name, allowed)) {
    return {};
  }
  return fail(
      ErrorCode::invalid_input,
      fmt::format("'{}' is not the name of a topic or service: expected one like /points, of "
                  "letters, digits, '_' and '/'",
                  name));
}

}  // namespace vantage::dds
