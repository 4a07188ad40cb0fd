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
#include "vantage/engine/toml.hpp"

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

/// Plugins that break a part of a clause that its first plugin keeps.
const std::map<std::string, std::vector<std::string>> kOtherWays{
    {"store", {"S6_directory"}}, {"matcher", {"C4_values", "M7_score", "M20_axes", "M20_origin"}}};

/// What the plugins of a kind break: each clause, some of them in several ways.
std::vector<std::string> ways_to_break(const std::string& kind, std::vector<std::string> clauses) {
  if (const auto others = kOtherWays.find(kind); others != kOtherWays.end()) {
    clauses.insert(clauses.end(), others->second.begin(), others->second.end());
  }
  return clauses;
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

/// Whether a clause has nothing to check in a plugin that breaks another one.
bool does_not_apply_to(const std::string& kind, const std::string& broken, const std::string& id) {
  if (kind == "ground") return broken == "G7" && id == "G12";          // its reach is infinite
  if (kind == "visibility") return broken == "V8" && id == "V17";      // the same
  if (kind == "store") return broken == "S27" && id.starts_with('S');  // it says that it only reads
  return false;
}

/// The clauses that were skipped, and why; all others are kept.
using Skipped = std::map<std::string, std::string>;
Skipped skipped_of(const Broken& plugin) {
  const test::Finished done = run_all({plugin}).at(plugin.plugin);
  CHECK(done.exit_code == 0);
  const auto report = nlohmann::json::parse(done.out, nullptr, false);
  REQUIRE_MESSAGE(!report.is_discarded(), done.err);
  Skipped skipped;
  for (const auto& clause : report["clauses"]) {
    const std::string id = clause["id"], outcome = clause["outcome"];
    CHECK_MESSAGE(outcome != "failed", plugin.plugin.string() << ", clause " << id);
    if (outcome == "skipped") skipped[id] = clause["detail"];
  }
  return skipped;
}

Skipped all_for(const std::string& why, const std::vector<int>& numbers, char letter) {
  Skipped skipped;
  for (const int number : numbers) skipped[letter + std::to_string(number)] = why;
  return skipped;
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
    for (const std::string& id : ways_to_break(traits.name, ids_of(traits.kind))) {
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
          << kind_name << ": plugin (down) x clause (across); F failed, . kept, - skipped\n"
          << std::string(18, ' ');
    for (const std::string& id : ids) table << std::setw(4) << id;
    table << '\n';
    clauses += ids.size();
    for (const std::string& way : ways_to_break(kind_name, ids)) {
      const std::string broken = way.substr(0, way.find('_'));
      const fs::path plugin = broken_plugin(kind_name, way).plugin;
      const auto outcome = outcomes(plugin, finished.at(plugin));
      table << "breaks_" << std::left << std::setw(11) << way << std::right;
      for (const std::string& id : ids) {
        const std::string& o = outcome.at(id);
        table << std::setw(4) << (o == "failed" ? "F" : o == "ok" ? "." : "-");
        const bool skipped = o == "skipped" && does_not_apply_to(kind_name, broken, id);
        CHECK_MESSAGE((skipped || o == (id == broken ? "failed" : "ok")),
                      kind_name << " breaks_" << way << ", clause " << id << ": " << o);
      }
      table << '\n';
    }
  });
  std::cout << table.str() << '\n'
            << clauses << " clauses, " << plugins.size() << " broken plugins\n";
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

TEST_CASE("a clause that a plugin gives nothing to check is skipped, and the reason is reported") {
  const auto least = [](const std::string& kind) {
    return skipped_of(broken_plugin(kind, "least"));
  };
  CHECK(least("partitioner") == Skipped{{"P11", "it cuts no map in passes"}});
  CHECK(least("ground") == Skipped{{"G12", "its reach is infinite"}});
  CHECK(least("visibility") == Skipped{{"V17", "its reach is infinite"}});
  CHECK(least("store") == all_for("the store keeps no attachments", {17, 20, 21, 22, 23, 24}, 'S'));
  Skipped stores_none = all_for("the matcher stores no prepared maps", {14, 15}, 'M');
  stores_none["M17"] = "its reach is infinite";
  CHECK(least("matcher") == stores_none);
}

TEST_CASE("of a store that only reads, what could not be checked is skipped") {
  const fs::path plugin = fs::path(SOUND_PLUGIN_DIR) / "vantage_store_grid_pcd.so";
  const fs::path params = fs::path(VANTAGE_SOURCE_DIR) / "tests/conformance/params";
  const Skipped writing = all_for(
      "the store only reads",
      {1, 2, 4, 6, 7, 8, 9, 10, 11, 12, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 26, 28}, 'S');
  CHECK(skipped_of({plugin, params / "store_grid_pcd.toml"}) == writing);
  Skipped reading = all_for("the store only reads, and claims no bundle", {3, 5, 25, 27}, 'S');
  reading.insert(writing.begin(), writing.end());
  CHECK(skipped_of({plugin, fs::path(CONTRACT_PARAMS_DIR) / "claims_no_bundle.toml"}) == reading);
}

TEST_CASE("a claim that excludes a clause is the reason why it is skipped") {
  const fs::path params = fs::path(VANTAGE_SOURCE_DIR) / "tests/conformance/params";
  const auto skipped = skipped_of({fs::path(SOUND_PLUGIN_DIR) / "vantage_visibility_keep_all.so",
                                   params / "visibility_keep_all.toml"});
  REQUIRE(skipped.contains("V2"));
  CHECK(skipped.at("V2") == "it claims occlusion = false");
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
