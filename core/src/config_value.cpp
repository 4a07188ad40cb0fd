#include "vantage/config_value.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numeric>
#include <sstream>

namespace vantage {
namespace {

/// Levenshtein distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

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
  char buffer[64];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, x);
  std::string text(buffer, error == std::errc{} ? end : buffer);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";  // TOML tells 1 from 1.0
  return text;
}

}  // namespace

const Value* Table::find(std::string_view key) const noexcept {
  for (const Entry& entry : entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

const char* type_name(const Value& value) noexcept {
  struct Namer {
    const char* operator()(bool) const { return "a boolean"; }
    const char* operator()(std::int64_t) const { return "an integer"; }
    const char* operator()(double) const { return "a number"; }
    const char* operator()(const std::string&) const { return "a string"; }
    const char* operator()(const Array&) const { return "an array"; }
    const char* operator()(const Table&) const { return "a table"; }
  };
  return std::visit(Namer{}, value.data);
}

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

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string* best = nullptr;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance && distance < candidate.size()) {
      best_distance = distance;
      best = &candidate;
    }
  }
  return best == nullptr ? "" : "; did you mean '" + *best + "'?";
}

}  // namespace vantage
