#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>
#include <tuple>
#include <utility>

#include "vantage/ground_filter.hpp"
#include "vantage/map_store.hpp"
#include "vantage/partitioner.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/selector.hpp"
#include "vantage/visibility.hpp"

namespace vantage {

/// What a plugin does. The value is the position in `kKinds` and in `AnyFactory`.
enum class PluginKind : std::uint8_t {
  partitioner,
  ground,
  visibility,
  store,
  matcher,
  selector,
  relocalizer
};

/// Everything that depends on the kind of a plugin.
template <class I>
struct Kind {
  using Interface = I;
  PluginKind kind;
  const char* name;            ///< in file names, and of its table in a configuration
  const char* interface_name;  ///< of `Interface`, in namespace vantage
  const char* header;          ///< of `Interface`
  const char* class_suffix;    ///< how the class name of a new plugin ends
};

/// All kinds, in the order of `PluginKind`. This is the only list of kinds.
inline constexpr std::tuple kKinds{
    Kind<Partitioner>{PluginKind::partitioner, "partitioner", "Partitioner",
                      "vantage/partitioner.hpp", "Partitioner"},
    Kind<GroundFilter>{PluginKind::ground, "ground", "GroundFilter", "vantage/ground_filter.hpp",
                       "GroundFilter"},
    Kind<VisibilityOperator>{PluginKind::visibility, "visibility", "VisibilityOperator",
                             "vantage/visibility.hpp", "Operator"},
    Kind<MapStore>{PluginKind::store, "store", "MapStore", "vantage/map_store.hpp", "Store"},
    Kind<ScanMatcher>{PluginKind::matcher, "matcher", "ScanMatcher", "vantage/scan_matcher.hpp",
                      "Matcher"},
    Kind<Selector>{PluginKind::selector, "selector", "Selector", "vantage/selector.hpp",
                   "Selector"},
    Kind<Relocalizer>{PluginKind::relocalizer, "relocalizer", "Relocalizer",
                      "vantage/relocalizer.hpp", "Relocalizer"},
};
inline constexpr std::size_t kPluginKinds = std::tuple_size_v<decltype(kKinds)>;

/// Calls f(Kind<...>) for every kind, in order.
template <class F>
constexpr void for_each_kind(const F& f) {
  std::apply([&](const auto&... kinds) { (f(kinds), ...); }, kKinds);
}

/// Calls f(Kind<...>) for the kind that a value of the enum stands for, and returns the result,
/// which has the same type for all kinds.
template <class F>
constexpr auto with_kind(PluginKind kind, const F& f) {
  using First = std::tuple_element_t<0, decltype(kKinds)>;
  using Result = std::invoke_result_t<const F&, const First&>;
  using Call = Result (*)(const F&);
  constexpr auto kCalls = []<std::size_t... I>(std::index_sequence<I...>) {
    return std::array<Call, sizeof...(I)>{
        [](const F& call) -> Result { return call(std::get<I>(kKinds)); }...};
  }
  (std::make_index_sequence<kPluginKinds>());
  return kCalls.at(static_cast<std::size_t>(kind))(f);
}

/// "partitioner", "ground", ...
[[nodiscard]] constexpr const char* to_string(PluginKind kind) {
  return with_kind(kind, [](const auto& traits) { return traits.name; });
}

/// The kind of an interface: `kind_of<GroundFilter>()`.
template <class Interface>
[[nodiscard]] constexpr PluginKind kind_of() noexcept {
  return std::get<Kind<Interface>>(kKinds).kind;
}

namespace detail {
template <class Kinds, template <class> class T>
struct OfEachKind;
template <template <class...> class List, template <class> class T, class... Interfaces>
struct OfEachKind<List<Kind<Interfaces>...>, T> {
  template <template <class...> class Target>
  using In = Target<T<Interfaces>...>;
};
}  // namespace detail

/// List<T<Partitioner>, T<GroundFilter>, ...> over all kinds, for example a std::variant of every
/// `Factory`.
template <template <class...> class List, template <class> class T>
using OfEachKind =
    typename detail::OfEachKind<std::remove_const_t<decltype(kKinds)>, T>::template In<List>;

static_assert(
    []<std::size_t... I>(std::index_sequence<I...>) {
      return ((std::get<I>(kKinds).kind == static_cast<PluginKind>(I)) && ...);
    }(std::make_index_sequence<kPluginKinds>()),
    "kKinds has the order of PluginKind");

}  // namespace vantage
