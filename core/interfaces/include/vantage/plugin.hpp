#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/params.hpp"
#include "vantage/plugin_kinds.hpp"
#include "vantage/result.hpp"

/// The header that a plugin includes. A plugin is one shared library, `vantage_<kind>_<name>.so`,
/// that exports one symbol. One line makes the symbol:
///
///     VANTAGE_PLUGIN(vantage::Partitioner, UniformGrid, "uniform_grid", "square cells");
///
/// Here UniformGrid derives from the interface, and has a type `Params` (see schema.hpp) and a
/// function `static Result<std::unique_ptr<vantage::Partitioner>> create(const Params&)`.

/// Grows by one whenever an interface, or a type that crosses the plugin boundary, changes.
#ifndef VANTAGE_INTERFACE_VERSION
#define VANTAGE_INTERFACE_VERSION 15
#endif

namespace vantage {

/// Numbers that must agree in loader and plugin before any code of the plugin may be called. The
/// loader reads these plain integers first.
struct AbiTag {
  std::uint32_t interface_version;
  std::uint32_t gxx_abi_version;
  std::uint32_t cxx11_abi;
  std::uint32_t eigen_version;          ///< world * 10000 + major * 100 + minor
  std::uint32_t eigen_max_align_bytes;  ///< changes with -mavx and similar flags
  std::uint32_t libstdcxx_debug;

  friend bool operator==(const AbiTag&, const AbiTag&) = default;
};

/// The tag of the code that includes this header, under its compiler flags.
[[nodiscard]] constexpr AbiTag abi_tag_here() noexcept {
  return {
      .interface_version = VANTAGE_INTERFACE_VERSION,
      .gxx_abi_version = __GXX_ABI_VERSION,
      .cxx11_abi = _GLIBCXX_USE_CXX11_ABI,
      .eigen_version =
          EIGEN_WORLD_VERSION * 10000 + EIGEN_MAJOR_VERSION * 100 + EIGEN_MINOR_VERSION,
      .eigen_max_align_bytes = EIGEN_MAX_ALIGN_BYTES,
#ifdef _GLIBCXX_DEBUG
      .libstdcxx_debug = 1,
#else
      .libstdcxx_debug = 0,
#endif
  };
}

/// The functions by which the engine creates an object of a plugin and learns its parameters. None
/// of them throws.
template <class Interface>
struct Factory {
  Result<std::unique_ptr<Interface>> (*create)(const Table& params) noexcept;
  Result<Table> (*effective_params)(const Table& params) noexcept;  ///< defaults filled in
  Result<std::vector<ParameterDoc>> (*describe)() noexcept;
};

/// The index of the variant is the kind; see `PluginKind`.
using AnyFactory = OfEachKind<std::variant, Factory>;

inline constexpr std::uint64_t kPluginMagic = 0x56414e5441474531;  // "VANTAGE1"

/// The one symbol that a plugin exports, named `vantage_plugin`. The first three members never
/// move.
struct PluginManifest {
  std::uint64_t magic = kPluginMagic;
  std::uint64_t size = sizeof(PluginManifest);
  AbiTag abi = abi_tag_here();
  const char* name = nullptr;     ///< as in the file name
  const char* summary = nullptr;  ///< one line
  AnyFactory factory;
};

/// The exception at hand, as an `internal` error that names the plugin in which `code` is.
[[nodiscard]] VANTAGE_API tl::unexpected<Error> caught_in(const void* code) noexcept;

// Each library has its own; the name is the compiler's.
// NOLINTNEXTLINE(bugprone-reserved-identifier)
extern "C" __attribute__((visibility("hidden"))) void* __dso_handle;

/// Turns an exception into an error. No exception may cross the plugin boundary, and every
/// interface method is noexcept. The body of each method therefore goes into a call of `guarded`:
///
///     return vantage::guarded([&] { return cells_of(map); });
template <class F>
auto guarded(F&& f) noexcept -> decltype(f()) {
  try {
    return std::forward<F>(f)();
  } catch (...) {
    return caught_in(&__dso_handle);
  }
}

namespace detail {

template <class Interface, class Implementation>
constexpr Factory<Interface> factory_of() noexcept {
  using Params = typename Implementation::Params;
  return {
      .create = [](const Table& table) noexcept -> Result<std::unique_ptr<Interface>> {
        return guarded([&]() -> Result<std::unique_ptr<Interface>> {
          VANTAGE_TRY(const auto params, parse<Params>(table));
          return Implementation::create(params);
        });
      },
      .effective_params = [](const Table& table) noexcept -> Result<Table> {
        return guarded([&]() -> Result<Table> {
          VANTAGE_TRY(const auto params, parse<Params>(table));
          return to_table(params);
        });
      },
      .describe = []() noexcept -> Result<std::vector<ParameterDoc>> {
        return guarded(
            []() -> Result<std::vector<ParameterDoc>> { return ::vantage::describe<Params>(); });
      },
  };
}

}  // namespace detail
}  // namespace vantage

#define VANTAGE_PLUGIN(Interface, Implementation, plugin_name, plugin_summary)                \
  extern "C" __attribute__((visibility("default"),                                            \
                            used)) constinit const ::vantage::PluginManifest vantage_plugin { \
    .name = plugin_name, .summary = plugin_summary,                                           \
    .factory = ::vantage::detail::factory_of<Interface, Implementation>()                     \
  }
