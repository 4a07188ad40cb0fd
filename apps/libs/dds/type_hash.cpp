#include "dds/type_hash.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

namespace vantage::dds {
namespace {

// type_description_interfaces/msg/FieldType.
constexpr auto kTypeIds = std::to_array<std::pair<std::string_view, unsigned>>({
    {"int8", 2},
    {"uint8", 3},
    {"int16", 4},
    {"uint16", 5},
    {"int32", 6},
    {"uint32", 7},
    {"int64", 8},
    {"uint64", 9},
    {"float32", 10},
    {"float64", 11},
    {"bool", 15},
    {"byte", 16},
    {"char", 3},  // as uint8
    {"string", 17},
});
constexpr unsigned kNested = 1, kBoundedString = 21, kArray = 48, kBoundedSequence = 96,
                   kUnboundedSequence = 144;

/// "geometry_msgs/msg/Point" for "geometry_msgs/Point".
std::string full_name(std::string_view type) {
  const std::size_t slash = type.find('/');
  if (slash == std::string_view::npos || type.find('/', slash + 1) != std::string_view::npos) {
    return std::string(type);
  }
  return fmt::format("{}/msg/{}", type.substr(0, slash), type.substr(slash + 1));
}

/// The next line, which is taken off the text.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

/// One member as JSON. @param line  "geometry_msgs/Point[] points", perhaps with a default value
Result<std::string> field(std::string_view line) {
  const auto refuse = [&] {
    return fail(ErrorCode::invalid_input,
                fmt::format("'{}' is not a member of a message: expected a type and a name", line));
  };
  const std::size_t space = line.find(' ');
  if (space == std::string_view::npos || space + 1 >= line.size()) return refuse();
  std::string_view type = line.substr(0, space);
  const std::string_view rest = line.substr(space + 1);
  const std::string_view name = rest.substr(0, rest.find(' '));
  unsigned container = 0, capacity = 0, string_capacity = 0;
  const auto number = [](std::string_view text, unsigned& value) {
    return std::from_chars(text.data(), text.data() + text.size(), value).ptr ==
           text.data() + text.size();
  };
  if (type.ends_with(']')) {
    const std::size_t bracket = type.find('[');
    if (bracket == std::string_view::npos) return refuse();
    std::string_view size = type.substr(bracket + 1, type.size() - bracket - 2);
    container = size.empty() ? kUnboundedSequence : kArray;
    if (size.starts_with("<=")) {
      container = kBoundedSequence;
      size.remove_prefix(2);
      if (size.empty()) return refuse();
    }
    if (!size.empty() && !number(size, capacity)) return refuse();
    type = type.substr(0, bracket);
  }
  unsigned id = kNested;
  std::string nested;
  if (const std::size_t bound = type.find("<="); bound != std::string_view::npos) {
    if (!number(type.substr(bound + 2), string_capacity)) return refuse();
    id = kBoundedString;
  } else if (const auto* const known =
                 std::ranges::find(kTypeIds, type, &std::pair<std::string_view, unsigned>::first);
             known != kTypeIds.end()) {
    id = known->second;
  } else if (type.find('/') != std::string_view::npos) {
    nested = full_name(type);
  } else {
    return refuse();
  }
  return fmt::format(
      R"({{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, )"
      R"("nested_type_name": "{}"}}}})",
      name, id + container, capacity, string_capacity, nested);
}

/// One type as JSON.
Result<std::string> description(std::string_view name, std::string_view members) {
  std::vector<std::string> fields;
  while (!members.empty()) {
    const std::string_view line = take_line(members);
    if (line.empty() || line.find('=') != std::string_view::npos) {
      // A constant is no part of what is sent; a bound on a string is.
      if (line.find("<=") == std::string_view::npos) continue;
    }
    VANTAGE_TRY(std::string one, field(line));
    fields.push_back(std::move(one));
  }
  return fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", name, fmt::join(fields, ", "));
}

std::string sha256(std::string_view text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  EVP_Digest(text.data(), text.size(), digest.data(), &size, EVP_sha256(), nullptr);
  return fmt::format("{:02x}", fmt::join(digest.begin(), digest.begin() + size, ""));
}

}  // namespace

Result<std::string> type_hash(const io::ros::MessageSchema& schema) {
  constexpr std::string_view kNext = "MSG: ";
  std::string_view text = schema.text;
  std::string name = full_name(schema.name), members;
  std::string whole;
  std::map<std::string, std::string> others;  // sorted by name, as the hash asks for
  const auto finish = [&]() -> Result<void> {
    VANTAGE_TRY(std::string json, description(name, members));
    (whole.empty() ? whole : others[name]) = std::move(json);
    return {};
  };
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (line.starts_with("====")) continue;
    if (!line.starts_with(kNext)) {
      members.append(line).append("\n");
      continue;
    }
    VANTAGE_CHECK(finish());
    name = full_name(line.substr(kNext.size()));
    members.clear();
  }
  VANTAGE_CHECK(finish());
  std::vector<std::string_view> referenced;
  for (const auto& [type, json] : others) referenced.push_back(json);
  return "RIHS01_" +
         sha256(fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})",
                            whole, fmt::join(referenced, ", ")));
}

}  // namespace vantage::dds
