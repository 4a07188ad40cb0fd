#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/config_value.hpp"
#include "vantage/result.hpp"
#include "vantage/schema.hpp"

/// Three functions that work from a schema (schema.hpp): `parse` reads a table, `to_table` writes
/// one, and `describe` lists what a table may contain, for people and programs.
namespace vantage {

enum class ValueKind : std::uint8_t { boolean, integer, number, string, path, choice, table };

/// The description of one parameter, for people and programs.
struct ParameterDoc {
  std::string key, type, unit, doc;  ///< type: "number", "array of 2 numbers", ...
  std::string equation, citation;    ///< see Source
  bool required = false;
  ValueKind kind = ValueKind::table;  ///< of the value, or of each element of an array
  bool array = false;
  std::optional<std::size_t> length;  ///< of an array whose length is fixed
  Range range;                        ///< of a number: allowed values that fit into the type
  std::vector<std::string> choices;   ///< of an enum
  std::optional<Value> default_value;
  std::vector<ParameterDoc> fields;  ///< of a table that has its own schema
};

template <HasSchema Params>
[[nodiscard]] Result<Params> parse(const Table& table);
template <HasSchema Params>
[[nodiscard]] Table to_table(const Params& params);
template <HasSchema Params>
[[nodiscard]] std::vector<ParameterDoc> describe();

namespace detail {

[[nodiscard]] VANTAGE_API tl::unexpected<Error> wrong_type(const Value&, std::string_view key,
                                                           std::string_view expected);
[[nodiscard]] VANTAGE_API tl::unexpected<Error> out_of_range(const Value&, std::string_view key,
                                                             const Range&, std::string_view unit);
[[nodiscard]] VANTAGE_API tl::unexpected<Error> wrong_choice(
    const Value&, std::string_view key, const std::vector<std::string>& choices);
[[nodiscard]] VANTAGE_API tl::unexpected<Error> missing_key(const Table&, std::string_view key,
                                                            std::string_view doc);
/// For an array that is too short or too long.
[[nodiscard]] VANTAGE_API tl::unexpected<Error> wrong_length(const Value&, std::string_view key,
                                                             std::string_view expected,
                                                             std::size_t length);
[[nodiscard]] VANTAGE_API Result<void> only_known_keys(const Table&,
                                                       const std::vector<std::string>& known);
/// Adds to an error of `validate` the place of its keys in the table.
[[nodiscard]] VANTAGE_API Error at_keys(Error, const Table&);
/// "number", "array of 2 numbers", "array of paths".
[[nodiscard]] VANTAGE_API std::string type_text(ValueKind, bool array,
                                                std::optional<std::size_t> length);
/// Resolves a relative path. A path in a file starts at the folder of that file. A path on the
/// command line starts at the current directory and becomes absolute. Without a location, the path
/// stays as it is.
[[nodiscard]] VANTAGE_API std::filesystem::path resolve_path(const std::string&,
                                                             const SourceLocation&);

/// What a type of a member says about its value. `Element` is the type of the value, or of each
/// element of an array.
template <class T>
struct Shape {
  using Element = T;
  static constexpr bool optional = false, array = false;
  static constexpr std::optional<std::size_t> length = std::nullopt;
};
template <class T>
struct Shape<std::vector<T>> : Shape<T> {
  static_assert(!Shape<T>::array, "arrays of arrays are not supported");
  static constexpr bool array = true;
};
template <int N>
struct Shape<Eigen::Matrix<double, N, 1>> : Shape<double> {
  static constexpr bool array = true;
  static constexpr std::optional<std::size_t> length = N;
};
template <class T>
struct Shape<std::optional<T>> : Shape<T> {
  static constexpr bool optional = true;
};

struct Context {
  std::string_view key, unit;
  Range range;
};

template <class T>
[[nodiscard]] std::vector<std::string> choices_of() {
  std::vector<std::string> names;
  if constexpr (std::is_enum_v<T>) {
    for (const auto& [name, value] : enum_names(T{})) names.emplace_back(name);
  }
  return names;
}

/// @tparam T  not an array
template <class T>
[[nodiscard]] constexpr ValueKind value_kind() {
  if constexpr (std::same_as<T, bool>) {
    return ValueKind::boolean;
  } else if constexpr (std::is_enum_v<T>) {
    return ValueKind::choice;
  } else if constexpr (std::integral<T>) {
    return ValueKind::integer;
  } else if constexpr (std::floating_point<T>) {
    return ValueKind::number;
  } else if constexpr (std::same_as<T, std::string>) {
    return ValueKind::string;
  } else if constexpr (std::same_as<T, std::filesystem::path>) {
    return ValueKind::path;
  } else {
    static_assert(HasSchema<T> || std::same_as<T, Table>);
    return ValueKind::table;
  }
}

template <class T>
[[nodiscard]] std::string type_of() {
  return type_text(value_kind<typename Shape<T>::Element>(), Shape<T>::array, Shape<T>::length);
}

/// The part of a range that type T can hold, if T is an integer. TOML's own integers have 64 bits.
template <class T>
[[nodiscard]] constexpr Range within_type(Range range) {
  if constexpr (std::integral<T> && !std::same_as<T, bool>) {
    const auto raise = [&](double min) {
      if (min > range.min) range.min = min, range.min_open = false;
    };
    const auto lower = [&](double max) {
      if (max < range.max) range.max = max, range.max_open = false;
    };
    if constexpr (std::unsigned_integral<T>) raise(0.0);
    if constexpr (sizeof(T) < sizeof(std::int64_t)) {
      raise(static_cast<double>(std::numeric_limits<T>::min()));
      lower(static_cast<double>(std::numeric_limits<T>::max()));
    }
  }
  return range;
}

/// "origin[1]".
[[nodiscard]] VANTAGE_API std::string element_key(std::string_view key, std::size_t index);

template <class T>
[[nodiscard]] Result<T> read_value(const Value& value, const Context& context) {
  if constexpr (Shape<T>::optional) {
    VANTAGE_TRY(auto inner, read_value<typename T::value_type>(value, context));
    return T{std::move(inner)};
  } else if constexpr (Shape<T>::array) {
    const auto* array = std::get_if<Array>(&value.data);
    if (array == nullptr) return wrong_type(value, context.key, "an " + type_of<T>());
    if (Shape<T>::length && array->size() != *Shape<T>::length) {
      return wrong_length(value, context.key, "an " + type_of<T>(), array->size());
    }
    T out;
    if constexpr (!Shape<T>::length) out.resize(array->size());
    std::size_t i = 0;
    for (auto&& x : out) {
      const std::string key = element_key(context.key, i);
      const Context of_element{key, context.unit, context.range};
      VANTAGE_TRY(x, read_value<typename Shape<T>::Element>((*array)[i++], of_element));
    }
    return out;
  } else if constexpr (std::same_as<T, bool>) {
    if (const auto* x = std::get_if<bool>(&value.data)) return *x;
    return wrong_type(value, context.key, "a boolean");
  } else if constexpr (std::is_enum_v<T>) {
    const auto* text = std::get_if<std::string>(&value.data);
    if (text == nullptr) return wrong_type(value, context.key, "a string");
    for (const auto& [name, choice] : enum_names(T{})) {
      if (name == *text) return choice;
    }
    return wrong_choice(value, context.key, choices_of<T>());
  } else if constexpr (std::integral<T>) {
    const auto* x = std::get_if<std::int64_t>(&value.data);
    if (x == nullptr) return wrong_type(value, context.key, "an integer");
    if (!context.range.contains(static_cast<double>(*x))) {
      return out_of_range(value, context.key, context.range, context.unit);
    }
    if (!std::in_range<T>(*x)) {
      return out_of_range(value, context.key, within_type<T>(context.range), context.unit);
    }
    return static_cast<T>(*x);
  } else if constexpr (std::floating_point<T>) {
    T x{};
    if (const auto* real = std::get_if<double>(&value.data)) {
      x = static_cast<T>(*real);
    } else if (const auto* whole = std::get_if<std::int64_t>(&value.data)) {
      x = static_cast<T>(*whole);
    } else {
      return wrong_type(value, context.key, "a number");
    }
    if (!std::isfinite(x) || !context.range.contains(static_cast<double>(x))) {
      return out_of_range(value, context.key, context.range, context.unit);
    }
    return x;
  } else if constexpr (std::same_as<T, std::string> || std::same_as<T, std::filesystem::path>) {
    const auto* text = std::get_if<std::string>(&value.data);
    if (text == nullptr) return wrong_type(value, context.key, "a string");
    if constexpr (std::same_as<T, std::string>) {
      return *text;
    } else {
      return resolve_path(*text, value.where);
    }
  } else {
    const auto* table = std::get_if<Table>(&value.data);
    if (table == nullptr) return wrong_type(value, context.key, "a table");
    if constexpr (std::same_as<T, Table>) {
      return *table;
    } else {
      return parse<T>(*table);
    }
  }
}

/// A member as a value; none for an empty optional.
template <class T>
[[nodiscard]] std::optional<Value> write_value(const T& x) {
  if constexpr (Shape<T>::optional) {
    return x ? write_value(*x) : std::nullopt;
  } else if constexpr (Shape<T>::array) {
    Array array;
    for (const auto& element : x) {
      if (auto value = write_value(element)) array.push_back(*std::move(value));
    }
    return Value{std::move(array), {}};
  } else if constexpr (std::same_as<T, bool> || std::same_as<T, std::string> ||
                       std::same_as<T, Table>) {
    return Value{x, {}};
  } else if constexpr (std::is_enum_v<T>) {
    for (const auto& [name, choice] : enum_names(T{})) {
      if (choice == x) return Value{std::string(name), {}};
    }
    return std::nullopt;
  } else if constexpr (std::integral<T>) {
    return Value{static_cast<std::int64_t>(x), {}};
  } else if constexpr (std::floating_point<T>) {
    return Value{static_cast<double>(x), {}};
  } else if constexpr (std::same_as<T, std::filesystem::path>) {
    return Value{x.string(), {}};
  } else {
    return Value{to_table(x), {}};
  }
}

}  // namespace detail

using detail::resolve_path;

/// Reads a table according to the schema of Params.
/// Errors: `invalid_config`, with its place, for an unknown key (with a suggestion), a missing key,
/// a wrong type, a value out of range or a non-finite number; errors of `Params::validate`.
template <HasSchema Params>
Result<Params> parse(const Table& table) {
  Params params{};
  std::vector<std::string> known;
  std::apply([&](const auto&... field) { (known.emplace_back(field.key), ...); }, Params::schema());
  VANTAGE_CHECK(detail::only_known_keys(table, known));

  const auto read = [&](const auto& field) -> Result<void> {
    using Member = std::remove_cvref_t<decltype(params.*field.member)>;
    const Value* value = table.find(field.key);
    if (value == nullptr) {
      if (field.required) return detail::missing_key(table, field.key, field.doc);
      return {};
    }
    const detail::Context context{field.key, field.unit, field.range};
    VANTAGE_TRY(params.*field.member, detail::read_value<Member>(*value, context));
    return {};
  };
  Result<void> done{};
  std::apply([&](const auto&... field) { (void)((done = read(field)) && ...); }, Params::schema());
  VANTAGE_CHECK(done);

  if constexpr (requires { params.validate(); }) {
    if (Result<void> valid = params.validate(); !valid) {
      return fail(detail::at_keys(std::move(valid).error(), table));
    }
  }
  return params;
}

/// A table of the effective values, including defaults.
template <HasSchema Params>
Table to_table(const Params& params) {
  Table table;
  const auto write = [&](const auto& field) {
    if (auto value = detail::write_value(params.*field.member)) {
      table.entries.push_back({std::string(field.key), *std::move(value), {}});
    }
  };
  std::apply([&](const auto&... field) { (write(field), ...); }, Params::schema());
  return table;
}

template <HasSchema Params>
std::vector<ParameterDoc> describe() {
  std::vector<ParameterDoc> docs;
  const Params defaults{};
  const auto add = [&](const auto& field) {
    using Member = std::remove_cvref_t<decltype(defaults.*field.member)>;
    using Shape = detail::Shape<Member>;
    using Element = typename Shape::Element;
    ParameterDoc doc{.key = std::string(field.key),
                     .type = detail::type_of<Member>(),
                     .unit = std::string(field.unit),
                     .doc = std::string(field.doc),
                     .equation = std::string(field.source.equation),
                     .citation = std::string(field.source.citation),
                     .required = field.required,
                     .kind = detail::value_kind<Element>(),
                     .array = Shape::array,
                     .length = Shape::length,
                     .range = detail::within_type<Element>(field.range),
                     .choices = detail::choices_of<Element>(),
                     .default_value = {},
                     .fields = {}};
    if (!field.required) doc.default_value = detail::write_value(defaults.*field.member);
    if constexpr (HasSchema<Element>) doc.fields = describe<Element>();
    docs.push_back(std::move(doc));
  };
  std::apply([&](const auto&... field) { (add(field), ...); }, Params::schema());
  return docs;
}

}  // namespace vantage
