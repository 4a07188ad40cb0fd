#include "support/plugins.hpp"

#include <stdexcept>

#include "vantage/engine/config.hpp"

namespace vantage::test {

Table table(const std::string& toml) {
  auto parsed = parse_toml(toml, "test.toml");
  if (!parsed) throw std::runtime_error(to_string(parsed.error()));
  return *std::move(parsed);
}

PluginLoader built_plugins() { return PluginLoader({VANTAGE_PLUGIN_DIR}); }

}  // namespace vantage::test
