// Every clause has a plugin that breaks it and no other: what the suite says of each is a table
// with failures on its diagonal only.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <future>
#include <iomanip>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "vantage/conformance.hpp"

using namespace vantage;
namespace fs = std::filesystem;

namespace {

/// A plugin that breaks a clause.
struct Broken {
  fs::path plugin, params;
};

Broken broken_plugin(const std::string& kind, const std::string& clause) {
  return {fs::path(CONTRACT_PLUGIN_DIR) / ("vantage_" + kind + "_breaks_" + clause + ".so"),
          fs::path(CONTRACT_PARAMS_DIR) / (kind + ".toml")};
}

/// Runs vantage-conformance on each, four at a time: stores mostly wait for the disk.
std::map<fs::path, test::Finished> run_all(const std::vector<Broken>& plugins) {
  std::map<fs::path, test::Finished> all;
  for (const Broken& broken : plugins) all[broken.plugin];
  std::atomic<std::size_t> next = 0;
  std::vector<std::future<void>> workers;
  for (int i = 0; i < 4; ++i) {
    workers.push_back(std::async(std::launch::async, [&] {
      for (std::size_t k = next++; k < plugins.size(); k = next++) {
        const auto& [plugin, params] = plugins[k];
        all.at(plugin) =
            test::run("vantage-conformance", {plugin.string(), params.string(), "--json"});
      }
    }));
  }
  for (std::future<void>& worker : workers) worker.get();
  return all;
}

/// What vantage-conformance said of one plugin: the outcome of every clause.
std::map<std::string, std::string> outcomes(const fs::path& plugin, const test::Finished& done) {
  const auto report = nlohmann::json::parse(done.out, nullptr, false);
  REQUIRE_MESSAGE(!report.is_discarded(), plugin.string() << ": " << done.err);
  std::map<std::string, std::string> outcome;
  for (const auto& clause : report["clauses"]) {
    outcome[clause["id"]] = clause["outcome"];
    if (clause["outcome"] == "failed") CHECK_FALSE(clause["detail"].get<std::string>().empty());
  }
  const bool any_failed = std::any_of(outcome.begin(), outcome.end(),
                                      [](const auto& o) { return o.second == "failed"; });
  CHECK(done.exit_code == (any_failed ? 1 : 0));
  return outcome;
}

}  // namespace

TEST_CASE("every clause is broken by its own plugin and by no other") {
  const auto ids_of = [](PluginKind kind) {
    std::vector<std::string> ids;
    for (const conformance::Clause& clause : conformance::clauses_of(kind)) {
      ids.emplace_back(clause.id);
    }
    return ids;
  };
  std::vector<Broken> plugins;
  for_each_kind([&](const auto& traits) {
    for (const std::string& id : ids_of(traits.kind)) {
      plugins.push_back(broken_plugin(traits.name, id));
    }
  });
  const std::map<fs::path, test::Finished> finished = run_all(plugins);

  std::size_t clauses = 0;
  std::ostringstream table;
  for_each_kind([&](const auto& traits) {
    const PluginKind kind = traits.kind;
    const std::string kind_name = traits.name;
    const std::vector<std::string> ids = ids_of(kind);
    table << '\n'
          << kind_name << ": plugin (down) x clause (across); F failed, . kept\n"
          << std::string(12, ' ');
    for (const std::string& id : ids) table << std::setw(4) << id;
    table << '\n';
    for (const std::string& broken : ids) {
      ++clauses;
      const fs::path plugin = broken_plugin(kind_name, broken).plugin;
      const auto outcome = outcomes(plugin, finished.at(plugin));
      table << "breaks_" << std::left << std::setw(5) << broken << std::right;
      for (const std::string& id : ids) {
        const std::string& o = outcome.at(id);
        table << std::setw(4) << (o == "failed" ? "F" : o == "ok" ? "." : "-");
        CHECK_MESSAGE(o == (id == broken ? "failed" : "ok"),
                      kind_name << " breaks_" << broken << ", clause " << id << ": " << o);
      }
      table << '\n';
    }
  });
  std::cout << table.str() << '\n' << clauses << " clauses, " << clauses << " broken plugins\n";
  CHECK(clauses >= 140);
}

TEST_CASE("a plugin that ends the process, or does not come back, has kept no clause") {
  const Broken exits = broken_plugin("partitioner", "exits");
  for (const auto& [id, outcome] : outcomes(exits.plugin, run_all({exits}).at(exits.plugin))) {
    CHECK_MESSAGE(outcome == (id[0] == 'C' ? "ok" : "failed"), id);
  }
  const auto [plugin, params] = broken_plugin("partitioner", "hangs");
  const auto hangs = test::run("vantage-conformance", {plugin.string(), params.string(), "--clause",
                                                       "P1", "--timeout", "0.5"});
  CHECK(hangs.exit_code == 1);
  CHECK(hangs.out.find("did not end within 0.5 s") != std::string::npos);
}

TEST_CASE("docs/contracts.md lists the clauses, word for word") {
  const std::string text = test::read_text(fs::path(VANTAGE_SOURCE_DIR) / "docs/contracts.md");
  std::set<std::string> listed;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("| ") && line.size() > 3 && line[3] >= '0' && line[3] <= '9') {
      listed.insert(line);
    }
  }
  std::set<std::string> kept;
  const auto keep_claims = [&](const std::vector<ParameterDoc>& claims) {
    for (const ParameterDoc& p : claims) {
      CHECK_MESSAGE(
          text.find("| `" + p.key + "` | " + p.unit + (p.unit.empty() ? "| `" : " | `") +
                    to_toml(p.default_value.value()) + "` | " + p.doc + " |") != std::string::npos,
          "no such line for the claim " << p.key);
    }
  };
  for_each_kind([&]<class Interface>(const Kind<Interface>& kind) {
    constexpr auto kAt = static_cast<std::size_t>(kind_of<Interface>());
    keep_claims(describe<std::variant_alternative_t<kAt, conformance::Claims>>());
    for (const auto& clause : conformance::clauses_of(kind.kind)) {
      kept.insert("| " + std::string(clause.id) + " | " + std::string(clause.text) + " |");
    }
  });
  for (const std::string& line : kept) CHECK_MESSAGE(listed.contains(line), "missing: " << line);
  for (const std::string& line : listed)
    CHECK_MESSAGE(kept.contains(line), "no such clause: " << line);
}
