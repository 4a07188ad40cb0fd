// The folder of the program that the paper's authors have published: opened, localized in, and
// written back.
#include <doctest/doctest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "world.hpp"

namespace fs = std::filesystem;

namespace vantage::test {
namespace {

std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("grid_")) files[name] = read_text(entry.path());
  }
  return files;
}

/// What the authors' program does with the ground, as far as a configuration says it.
std::string as_the_authors(const Street& street) {
  const std::string config = street.write_config("as_authors.toml", 20.0, "as_authors");
  std::string text = read_text(config);
  const auto replace = [&](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    text.replace(at, from.size(), to);
  };
  replace("cell_width = 20.000000", "cell_width = 20.0, origin = \"ground\"");
  replace("plugin = \"pmf\"\n", "plugin = \"pmf\"\noutliers = { neighbours = 50, ratio = 1.0 }\n");
  write_text(config, text);
  return config;
}

TEST_CASE("a folder of grid_i_j.pcd opens, localizes, and is written back byte for byte") {
  const Street street;
  const std::string built = as_the_authors(street);
  const auto build = run("vantage-build", {built, "-q", "--json"});
  REQUIRE_MESSAGE(build.exit_code == 0, build.err);
  const fs::path folder = street.path("folder"), back = street.path("back");
  REQUIRE(run("vantage-export", {"grid", built, "--out", folder, "-q"}).exit_code == 0);
  // As their program leaves it: nothing of ours beside its files.
  fs::remove(folder / "vantage_export.json");
  const auto files = files_of(folder);
  REQUIRE(files.size() >= 4);

  write_text(street.path("folder.toml"),
             "schema = 1\n[store]\nplugin = \"grid_pcd\"\nparams = { root = \"folder\" }\n"
             "[matcher]\nplugin = \"ndt\"\n");
  const auto ran = street.localize(street.path("folder.toml"), "run", {"-q"});
  REQUIRE_MESSAGE(ran.exit_code == 0, ran.err);
  const auto summary = nlohmann::json::parse(read_text(street.folder() / "run/summary.json"));
  // The fronts of the street are alike: the first scan alone may leave open which one it sees.
  CHECK(summary["scans"]["tracked"] >= Street::kScans - 1);
  CHECK(summary["scans"]["lost"] == 0);
  CHECK(summary["scans"]["switched"] >= 1);
  CHECK(summary["error_m"]["mean"] < 0.05);

  REQUIRE(
      run("vantage-export", {"grid", street.path("folder.toml"), "--out", back, "-q"}).exit_code ==
      0);
  CHECK(files_of(back) == files);
  CHECK(files_of(folder) == files);
}

TEST_CASE("a bundle remembers its origin and its outliers, and no number of threads changes it") {
  const Street street;
  const std::string config = as_the_authors(street);
  REQUIRE(run("vantage-build", {config, "-q", "--jobs", "1"}).exit_code == 0);
  const std::string index = read_text(street.path("as_authors/index.json"));
  CHECK(index.find("origin = \\\"ground\\\"") != std::string::npos);
  CHECK(index.find("ratio = 1.0") != std::string::npos);
  REQUIRE(run("vantage-build", {config, "-q", "--jobs", "2", "--overwrite"}).exit_code == 0);
  CHECK(read_text(street.path("as_authors/index.json")) == index);

  for (const std::string other :
       {"ground.outliers.ratio=2.0", "partitioner.params.origin=[0, 0]"}) {
    const auto refused = street.localize(config, "run", {"-q", "--set", other});
    CHECK(refused.exit_code == 1);
    CHECK_MESSAGE(refused.err.find("and the bundle was built with") != std::string::npos,
                  refused.err);
  }
}

}  // namespace
}  // namespace vantage::test
