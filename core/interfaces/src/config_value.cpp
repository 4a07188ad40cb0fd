#include "vantage/config_value.hpp"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <utility>

namespace vantage {
namespace {

/// The number of edits that turn a into b. An edit is a letter too many, a missing letter, a wrong
/// letter, or two neighbours swapped (optimal string alignment).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, last, row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = std::exchange(last, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] =
          std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
  }
  return row[b.size()];
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
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

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates,
                         const std::vector<std::string>& written) {
  std::vector<std::string> best;
  std::pair best_rank{std::max<std::size_t>(2, word.size() / 3), true};
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(lower_case(word), lower_case(candidate));
    if (distance >= candidate.size()) continue;  // no letter of the candidate is left
    const std::pair rank{distance,
                         std::find(written.begin(), written.end(), candidate) != written.end()};
    if (rank > best_rank) continue;
    if (rank < best_rank) best.clear();
    best_rank = rank;
    if (std::find(best.begin(), best.end(), candidate) == best.end()) best.push_back(candidate);
  }
  std::string text;
  for (std::size_t i = 0; i < best.size(); ++i) {
    text += (i == 0 ? "" : i + 1 < best.size() ? ", " : " or ") + ("'" + best[i] + "'");
  }
  return text.empty() ? "" : "; did you mean " + text + "?";
}

}  // namespace vantage
