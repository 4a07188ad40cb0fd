#pragma once

#include <concepts>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <tuple>

#include "vantage/api.hpp"
#include "vantage/result.hpp"

/// Parameters that describe themselves. One schema tuple drives parsing, checks, defaults,
/// `vantage plugins describe` and the effective configuration.
///
///     struct Params {
///       double cell_width{};  // L of Eq. 2
///       static constexpr auto schema() {
///         return std::tuple{
///             required("cell_width", &Params::cell_width, "m", "grid width L", positive,
///                      Source{"Eq. 2", "Yagi et al. 2026, Sec. 2.1"})};
///       }
///     };
///
/// A key declared with `optional` may be left out. A `std::optional<T>` member is then empty, and
/// its doc says what that means; any other member keeps the value of a default-constructed Params.
/// An enum needs a function in its own namespace, `constexpr auto enum_names(Kernel)`, that returns
/// an array of pairs of string_view and Kernel. A struct may add `Result<void> validate() const`
/// for checks that involve more than one parameter. It fails with `fail_at`, so that the error
/// points at the key at fault.
namespace vantage {

/// The values that a number may take.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_open = false, max_open = false;

  [[nodiscard]] constexpr bool contains(double x) const noexcept {
    return (min_open ? x > min : x >= min) && (max_open ? x < max : x <= max);
  }
  /// "> 0", ">= 1", "in [0, 1)", "1" for [1, 1]; "" if every number is allowed.
  [[nodiscard]] VANTAGE_API std::string to_string() const;
};

inline constexpr Range any_number{};
inline constexpr Range positive{.min = 0.0, .min_open = true};
inline constexpr Range non_negative{.min = 0.0};
[[nodiscard]] constexpr Range at_least(double min) { return {.min = min}; }
[[nodiscard]] constexpr Range between(double min, double max) { return {.min = min, .max = max}; }
[[nodiscard]] constexpr Range strictly_between(double min, double max) {
  return {.min = min, .max = max, .min_open = true, .max_open = true};
}

/// Where a parameter comes from; empty if there is no source.
struct Source {
  std::string_view equation = {};  ///< of the paper that this project follows: "Eq. 2"
  std::string_view citation = {};  ///< "Yagi et al. 2026, Sec. 2.1", "Katz et al. 2007"
};

template <class Params, class Member>
struct Field {
  std::string_view key;
  Member Params::*member;
  std::string_view unit, doc;
  bool required;
  Range range = any_number;
  Source source = {};

  constexpr void add(const Range& given) noexcept { range = given; }
  constexpr void add(const Source& given) noexcept { source = given; }
};

/// A key that must be given.
/// @param more  its Range, its Source, or both
template <class Params, class Member, class... More>
[[nodiscard]] constexpr Field<Params, Member> required(std::string_view key, Member Params::*member,
                                                       std::string_view unit, std::string_view doc,
                                                       const More&... more) {
  Field<Params, Member> field{key, member, unit, doc, true};
  (field.add(more), ...);
  return field;
}
/// A key that may be left out.
template <class Params, class Member, class... More>
[[nodiscard]] constexpr Field<Params, Member> optional(std::string_view key, Member Params::*member,
                                                       std::string_view unit, std::string_view doc,
                                                       const More&... more) {
  auto field = ::vantage::required(key, member, unit, doc, more...);
  field.required = false;
  return field;
}

/// The error of a `validate`.
/// @param keys     the keys at fault (`a.b` for a key of a nested table). The error points at the
///                 first of them that is in the table, or at the table itself if none is
/// @param message  what is wrong
[[nodiscard]] VANTAGE_API tl::unexpected<Error> fail_at(
    std::initializer_list<std::string_view> keys, std::string message);

/// No parameters.
struct NoParams {
  static constexpr auto schema() { return std::tuple{}; }
};

template <class T>
concept HasSchema = requires {
  T::schema();
};

}  // namespace vantage
