#include "vantage/engine/plugin_loader.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "support/cut.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

using namespace vantage;
namespace fs = std::filesystem;

namespace {

const fs::path kBroken = BROKEN_PLUGIN_DIR;

std::string prefix(const std::string& file) { return "error: " + (kBroken / file).string() + ": "; }

/// Refused for this reason, in one line.
void check_refused(const std::string& file, const std::string& why) {
  const auto info = PluginLoader({}).inspect(kBroken / file);
  REQUIRE_FALSE(info.has_value());
  CHECK(info.error().code == ErrorCode::incompatible_plugin);
  const std::string text = to_string(info.error());
  CHECK(text.find('\n') == std::string::npos);
  CHECK(text == prefix(file) + why);
}

}  // namespace

TEST_CASE("a plugin built for another ABI is refused with what differs") {
  check_refused("vantage_ground_old_interface.so",
                "built for plugin interface version 0, this program has " +
                    std::to_string(VANTAGE_INTERFACE_VERSION));
  check_refused(
      "vantage_ground_wide_eigen.so",
      "built for an Eigen alignment (EIGEN_MAX_ALIGN_BYTES; -mavx and -march change it) of 32, "
      "this program has 16");
}

TEST_CASE("a plugin of another C++ ABI is refused before any of its code runs") {
  // In a process of its own: what a constructor of the plugin prints would be in its output.
  const auto check = [](const std::string& file) {
    const auto done = test::run("vantage-plugins", {"check", (kBroken / file).string()});
    CHECK(done.exit_code == 1);
    CHECK(done.out.empty());
    return done.err;
  };
  CHECK(check("vantage_ground_old_abi.so") ==
        prefix("vantage_ground_old_abi.so") +
            "built for _GLIBCXX_USE_CXX11_ABI 0, this program has 1\n");
  CHECK(check("vantage_ground_debug_containers.so") ==
        prefix("vantage_ground_debug_containers.so") +
            "built for libstdc++ debug mode 1, this program has 0\n");
}

TEST_CASE("a plugin that throws from a method ends the program with its message") {
  const test::TemporaryFolder folder;
  const fs::path config = folder.path() / "c.toml", map = folder.path() / "map.pcd";
  std::string pcd =
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 400\nHEIGHT 1\n"
      "POINTS 400\nDATA ascii\n";
  for (int i = 0; i < 400; ++i) {
    pcd += std::to_string(i % 20) + " " + std::to_string(i / 20) + " 0\n";
  }
  test::write_text(map, pcd);
  const auto build = [&](const std::string& ground, const std::string& visibility) {
    test::write_text(config,
                     "schema = 1\n[map]\nfiles = [\"map.pcd\"]\n[partitioner]\n"
                     "plugin = \"whole_map\"\n[ground]\nplugin = \"" +
                         ground + "\"\n[visibility]\nplugin = \"" + visibility +
                         "\"\n[store]\nplugin = \"pcd_tiles\"\n"
                         "params = { root = \"bundle\" }\n");
    return test::run("vantage-build",
                     {config.string(), "--plugin-dir", kBroken.string(), "--quiet"});
  };
  const std::string message = "error: an exception left a function that must not throw: ";
  const auto in_ground = build("throws", "keep_all");
  CHECK(in_ground.exit_code == 1);
  CHECK(in_ground.err == message + "out of ground (while running vantage_ground_throws.so)\n");
  // From a task of the thread pool, too, it neither hangs nor gets lost.
  const auto in_parallel = build("pmf", "throws");
  CHECK(in_parallel.exit_code == 1);
  CHECK(in_parallel.err ==
        message + "the scene went dark (while running vantage_visibility_throws.so)\n");
  CHECK_FALSE(fs::exists(folder.path() / "bundle"));
  // Memory that a plugin does not get is an error like any other, and names the plugin.
  const auto out_of_memory = build("pmf", "out_of_memory");
  CHECK(out_of_memory.exit_code == 1);
  CHECK(out_of_memory.err.starts_with(
      "error: out of memory (while running vantage_visibility_out_of_memory.so"));
  CHECK_FALSE(fs::exists(folder.path() / "bundle"));
  // What it left is no obstacle.
  CHECK(build("pmf", "keep_all").exit_code == 0);
}

TEST_CASE("kind and name must match the file name") {
  check_refused("vantage_ground_other_name.so",
                "calls itself 'somebody_else', its file name says 'other_name'");
  check_refused("vantage_partitioner_wrong_kind.so",
                "is a ground plugin by its content, a partitioner plugin by its name");
}

TEST_CASE("what is no plugin, no library or not complete is refused, never run") {
  check_refused("vantage_ground_no_manifest.so",
                "is no Vantage plugin: it lacks the symbol 'vantage_plugin'");
  check_refused("vantage_ground_undefined_symbol.so",
                "cannot be loaded: no library that it names has the symbol 'defined_nowhere()'");

  const test::TemporaryFolder folder;
  const fs::path text = folder.path() / "vantage_ground_text.so";
  test::write_text(text, "this is no library");
  CHECK(to_string(PluginLoader({}).inspect(text).error()) ==
        "error: " + text.string() + ": is not a shared library (it does not begin as an ELF file)");
  // Cut anywhere, the file is refused; the dynamic linker itself would die of SIGBUS.
  const std::string whole = test::read_text(kBroken / "vantage_ground_old_interface.so");
  for (std::size_t size = 1; size < whole.size();
       size += std::max<std::size_t>(509, whole.size() / 64)) {
    // A new file each time: one whose segments are complete is opened, and then stays mapped.
    const fs::path cut = folder.path() / ("vantage_ground_cut_" + std::to_string(size) + ".so");
    test::write_text(cut, whole.substr(0, size));
    const auto info = PluginLoader({}).inspect(cut);
    REQUIRE_FALSE(info.has_value());
    CHECK(info.error().code == ErrorCode::incompatible_plugin);
    if (size >= 64) {
      CHECK(to_string(info.error()) ==
            "error: " + cut.string() + ": is cut short: its ELF headers promise more than its " +
                std::to_string(size) + " bytes");
    }
  }
  CHECK(PluginLoader({}).inspect(folder.path() / "none.so").error().code == ErrorCode::not_found);
}

TEST_CASE("a miss says what is there and what was probably meant, at the place in the file") {
  const PluginLoader loader({VANTAGE_PLUGIN_DIR});
  const auto missed = loader.load<Partitioner>(
      PluginChoice{"unifrom_grid", {}, {}, SourceLocation{"map.toml", 5, 10}});
  REQUIRE_FALSE(missed.has_value());
  const std::string text = to_string(missed.error());
  CHECK(
      text.starts_with("map.toml:5:10: error: no partitioner plugin 'unifrom_grid'; did you mean "
                       "'uniform_grid'? (there are: "));
  CHECK(text.find("vantage_partitioner_unifrom_grid.so") != std::string::npos);
}

TEST_CASE("the explicit library must hold the plugin that is asked for") {
  const PluginLoader loader({});
  const fs::path grid = fs::path(VANTAGE_PLUGIN_DIR) / "vantage_partitioner_uniform_grid.so";
  CHECK(loader.load<Partitioner>({"uniform_grid", grid, test::table("cell_width = 1"), {}})
            .has_value());
  CHECK(loader.load<Partitioner>({"whole_map", grid, {}, {}}).error().message ==
        grid.string() + ": holds the plugin 'uniform_grid', not 'whole_map'");
  CHECK(loader.load<GroundFilter>({"uniform_grid", grid, {}, {}}).error().message ==
        grid.string() + ": is a partitioner plugin, expected a ground plugin");
}

TEST_CASE("folders are searched in order: the first one wins, missing ones hold nothing") {
  const test::TemporaryFolder first;
  const fs::path grid = fs::path(VANTAGE_PLUGIN_DIR) / "vantage_partitioner_uniform_grid.so";
  fs::copy_file(grid, first.path() / grid.filename());
  test::write_text(first.path() / "notes.txt", "");
  const PluginLoader loader({"/does/not/exist", first.path(), VANTAGE_PLUGIN_DIR});
  for (const PluginFile& file : loader.list()) {
    if (file.name == "uniform_grid") CHECK(file.path.parent_path() == first.path());
    if (file.name == "whole_map") CHECK(file.path.parent_path() == VANTAGE_PLUGIN_DIR);
  }
}

TEST_CASE(
    "$VANTAGE_PLUGIN_PATH comes after --plugin-dir and before the folder beside the library") {
  setenv("VANTAGE_PLUGIN_PATH", "/a::/b", 1);
  const PluginLoader loader = PluginLoader::with_default_folders({"/c"});
  unsetenv("VANTAGE_PLUGIN_PATH");
  REQUIRE(loader.folders().size() == 4);
  CHECK(loader.folders()[0] == "/c");
  CHECK(loader.folders()[1] == "/a");
  CHECK(loader.folders()[2] == "/b");
  CHECK(fs::equivalent(loader.folders()[3], VANTAGE_PLUGIN_DIR));
}

TEST_CASE("an object keeps its library loaded, also after the loader and its parent are gone") {
  PluginPtr<Partitioner> grid;
  {
    const PluginLoader loader({VANTAGE_PLUGIN_DIR});
    grid = *loader.load<Partitioner>({"uniform_grid", {}, test::table("cell_width = 5"), {}});
  }
  const PointCloud map{{0, 0, 0}, {12, 0, 0}};
  CHECK(test::cut(grid, map)->size() == 2);

  PluginPtr<VisibilityScene> scene;
  {
    const auto keep_all = test::plugin<VisibilityOperator>("keep_all");
    auto prepared = keep_all->prepare(map, {.map_bounds = bounds_of(map)});
    REQUIRE(prepared);
    scene = in_library_of(keep_all, *std::move(prepared));
  }
  CHECK(scene->visible({1, 0, 0}).has_value());
}

TEST_CASE("parameters are checked by the plugin, at their place") {
  const auto wrong = test::built_plugins().load<Partitioner>(
      {"uniform_grid", {}, test::table("cell_with = 5"), {}});
  CHECK(to_string(wrong.error()) ==
        "test.toml:1:1: error: unknown key 'cell_with'; did you mean 'cell_width'?");
}

TEST_CASE("every plugin exports one symbol, describes itself, and documents every parameter") {
  const auto files = test::built_plugins().list();
  CHECK(files.size() >= 7);
  for (const PluginFile& file : files) {
    const auto info = PluginLoader({}).inspect(file.path);
    REQUIRE_MESSAGE(info, to_string(info.error()));
    CHECK(info->kind == file.kind);
    CHECK(info->name == file.name);
    CHECK_FALSE(info->summary.empty());
    for (const ParameterDoc& parameter : info->parameters) CHECK_FALSE(parameter.doc.empty());
  }
}
