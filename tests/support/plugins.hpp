#pragma once

#include <string>

#include "vantage/engine/plugin_loader.hpp"

namespace vantage::test {

/// Parses TOML text into a table; a mistake in it ends the test with an exception.
[[nodiscard]] Table table(const std::string& toml);

/// The loader over the built plugins.
[[nodiscard]] PluginLoader built_plugins();

/// One of the built plugins, loaded from its own .so through the loader.
///     const auto hpr = test::plugin<VisibilityOperator>("hpr", "alpha = 100.0");
template <class Interface>
[[nodiscard]] PluginPtr<Interface> plugin(const std::string& name, const std::string& toml = {}) {
  auto loaded = built_plugins().load<Interface>(
      PluginChoice{.plugin = name, .library = {}, .params = table(toml), .where = {}});
  if (!loaded) throw std::runtime_error(to_string(loaded.error()));
  return *std::move(loaded);
}

}  // namespace vantage::test
