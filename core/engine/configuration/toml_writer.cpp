#include <algorithm>
#include <cctype>
#include <cmath>
#include <sstream>
#include <string_view>

#include "vantage/engine/toml.hpp"
#include "vantage/kit/numbers.hpp"

namespace vantage {
namespace {

std::string quoted(const std::string& text) {
  std::ostringstream out;
  out << '"';
  for (const char c : text) {
    switch (c) {
      case '"': out << "\\\""; break;
      case '\\': out << "\\\\"; break;
      case '\n': out << "\\n"; break;
      case '\t': out << "\\t"; break;
      case '\r': out << "\\r"; break;
      default:
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
          constexpr std::string_view kHex = "0123456789ABCDEF";
          const auto code = static_cast<unsigned char>(c);
          out << "\\u00" << kHex[code >> 4U] << kHex[code & 15U];
        } else {
          out << c;
        }
    }
  }
  out << '"';
  return out.str();
}

std::string written_key(const std::string& key) {
  const bool bare = !key.empty() && std::all_of(key.begin(), key.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
  });
  return bare ? key : quoted(key);
}

std::string written_number(double x) {
  if (std::isnan(x)) return "nan";
  if (std::isinf(x)) return x > 0 ? "inf" : "-inf";
  std::string text = shortest(x);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";  // TOML distinguishes 1 from 1.0
  return text;
}

}  // namespace

std::string to_toml(const Value& value) {
  struct Writer {
    std::string operator()(bool x) const { return x ? "true" : "false"; }
    std::string operator()(std::int64_t x) const { return std::to_string(x); }
    std::string operator()(double x) const { return written_number(x); }
    std::string operator()(const std::string& x) const { return quoted(x); }
    std::string operator()(const Array& array) const {
      std::string text = "[";
      for (std::size_t i = 0; i < array.size(); ++i) text += (i ? ", " : "") + to_toml(array[i]);
      return text + "]";
    }
    std::string operator()(const Table& table) const {
      std::string text = "{";
      for (const Entry& entry : table.entries) {
        text +=
            (text.size() > 1 ? ", " : " ") + written_key(entry.key) + " = " + to_toml(entry.value);
      }
      return text + (text.size() > 1 ? " }" : "}");
    }
  };
  return std::visit(Writer{}, value.data);
}

std::string to_toml(const Table& table, const std::string& prefix) {
  std::string text;
  for (const Entry& entry : table.entries) {
    if (!std::holds_alternative<Table>(entry.value.data)) {
      text += written_key(entry.key) + " = " + to_toml(entry.value) + "\n";
    }
  }
  for (const Entry& entry : table.entries) {
    if (const auto* section = std::get_if<Table>(&entry.value.data)) {
      const std::string name = prefix + written_key(entry.key);
      text += (text.empty() ? "[" : "\n[") + name + "]\n" + to_toml(*section, name + ".");
    }
  }
  return text;
}

}  // namespace vantage
