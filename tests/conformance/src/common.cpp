// C: the clauses that every plugin must keep, whatever its kind.
#include <algorithm>
#include <array>
#include <set>

#include "clauses.hpp"
#include "vantage/engine/toml.hpp"

namespace vantage::conformance {
namespace {

void documented(const Subject& subject) {
  CHECK_FALSE(subject.info().summary.empty());
  std::set<std::string> keys;
  for (const ParameterDoc& p : subject.info().parameters) {
    CAPTURE(p.key);
    CHECK_FALSE(p.doc.empty());
    CHECK(keys.insert(p.key).second);
    CHECK(!p.key.empty());
    CHECK(std::all_of(p.key.begin(), p.key.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
    }));
  }
}

void unknown_key(const Subject& subject) {
  Table params = subject.params();
  params.entries.push_back({"no_such_parameter", Value{1.0, {}}, {}});
  const auto effective = subject.effective_params(params);
  REQUIRE_FALSE(effective.has_value());
  CHECK(effective.error().code == ErrorCode::invalid_config);
  CHECK_MESSAGE(effective.error().message.find("no_such_parameter") != std::string::npos,
                "the message should name the key: " << effective.error().message);
}

void wrong_type(const Subject& subject) {
  for (const ParameterDoc& p : subject.info().parameters) {
    CAPTURE(p.key);
    Table params = subject.params();
    std::erase_if(params.entries, [&](const Entry& entry) { return entry.key == p.key; });
    // No parameter is a table of arrays.
    const Table nonsense{{{"nonsense", Value{Array{}, {}}, {}}}, {}};
    params.entries.push_back({p.key, Value{nonsense, {}}, {}});
    const auto effective = subject.effective_params(params);
    REQUIRE_FALSE(effective.has_value());
    CHECK(effective.error().code == ErrorCode::invalid_config);
    CHECK_MESSAGE(effective.error().message.find(p.key) != std::string::npos,
                  "the message should name the key: " << effective.error().message);
  }
}

/// Whether a value is the one that was given; 2 is 2.0. A path may be completed.
bool is_same(const Value& given, const Value& effective, const ParameterDoc& doc);

bool is_same(const Table& given, const Table& effective, const std::vector<ParameterDoc>& docs) {
  return std::ranges::all_of(given.entries, [&](const Entry& entry) {
    const Value* value = effective.find(entry.key);
    const auto doc = std::ranges::find(docs, entry.key, &ParameterDoc::key);
    return value != nullptr &&
           is_same(entry.value, *value, doc == docs.end() ? ParameterDoc{} : *doc);
  });
}

bool is_same(const Value& given, const Value& effective, const ParameterDoc& doc) {
  if (doc.kind == ValueKind::path) return true;
  if (const auto* whole = std::get_if<std::int64_t>(&given.data)) {
    const auto* number = std::get_if<double>(&effective.data);
    if (number != nullptr) return *number == static_cast<double>(*whole);
  }
  if (given.data.index() != effective.data.index()) return false;
  if (const auto* table = std::get_if<Table>(&given.data)) {
    return is_same(*table, std::get<Table>(effective.data), doc.fields);
  }
  if (const auto* array = std::get_if<Array>(&given.data)) {
    const auto& other = std::get<Array>(effective.data);
    return std::ranges::equal(*array, other,
                              [&](const Value& a, const Value& b) { return is_same(a, b, doc); });
  }
  return to_toml(given) == to_toml(effective);
}

void effective_params(const Subject& subject) {
  const auto once = subject.effective_params(subject.params());
  REQUIRE_MESSAGE(once, to_string(once.error()));
  for (const Entry& given : subject.params().entries) {
    CHECK_MESSAGE(once->find(given.key) != nullptr, "'" << given.key << "' got lost");
    CHECK_MESSAGE(is_same(Table{{given}, {}}, *once, subject.info().parameters),
                  "'" << given.key << "' has another value");
  }
  const auto twice = subject.effective_params(*once);
  REQUIRE_MESSAGE(twice, to_string(twice.error()));
  CHECK(to_toml(*once) == to_toml(*twice));
}

constexpr std::array kClauses{
    Clause{"C1", "the plugin and each of its parameters say what they are", &documented},
    Clause{"C2", "an unknown parameter is invalid_config, and the message names it", &unknown_key},
    Clause{"C3", "a parameter of the wrong type is invalid_config, and the message names it",
           &wrong_type},
    Clause{
        "C4",
        "the effective parameters are all given ones, with their values, and reproduce themselves",
        &effective_params},
};

}  // namespace

std::span<const Clause> common_clauses() { return kClauses; }

}  // namespace vantage::conformance
