#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "tiny_scans.hpp"

namespace vantage::test {
namespace {

struct Runs {
  TemporaryFolder folder;
  std::string a = (folder.path() / "a.csv").string(), b = (folder.path() / "b.csv").string();
  Runs() {
    write_text(a, tiny_csv({{.stamp = "1", .error_m = "0.02"}, {.stamp = "2", .error_m = "0.04"}}));
    write_text(b, tiny_csv({{.stamp = "1", .error_m = "0.01"}, {.stamp = "3", .error_m = "0.04"}}));
  }
};

TEST_CASE_FIXTURE(Runs, "compare prints both runs, which scans pair, and a row a quantity") {
  const auto done = run("vantage-compare", {a, b});
  CHECK(done.exit_code == 0);
  CHECK(done.err.empty());
  CHECK(done.out.find("1 scan in both; only in A: 1 (2 s); only in B: 1 (3 s)") !=
        std::string::npos);
  CHECK(std::regex_search(done.out, std::regex("\nerror \\[cm\\] +1 +[0-9]")));
}

TEST_CASE_FIXTURE(Runs, "compare writes a page and prints JSON") {
  const std::string page = (folder.path() / "page.html").string();
  const auto done = run("vantage-compare", {a, b, "--html", page, "--json"});
  CHECK(done.exit_code == 0);
  const auto json = nlohmann::json::parse(done.out);
  CHECK(json["quantities"]["error_m"]["difference"].get<double>() == doctest::Approx(-1.0));
  CHECK(read_text(page).find("<!DOCTYPE html>") == 0);
}

TEST_CASE_FIXTURE(Runs, "compare overwrites no run") {
  const auto run_a = folder.path() / "run";
  std::filesystem::create_directory(run_a);
  std::filesystem::rename(a, run_a / "scans.csv");
  const std::string before = read_text(run_a / "scans.csv");
  const auto done =
      run("vantage-compare", {run_a.string(), b, "--html", (run_a / "scans.csv").string()});
  CHECK(done.exit_code == 2);
  CHECK(done.err.find("--html would overwrite") != std::string::npos);
  CHECK(read_text(run_a / "scans.csv") == before);
}

TEST_CASE_FIXTURE(Runs, "compare says in which file and line an input is wrong") {
  write_text(b, "stamp\n1\n");
  const auto done = run("vantage-compare", {a, b});
  CHECK(done.exit_code == 1);
  CHECK(done.err.starts_with(b + ":1: error: no column"));
  CHECK(run("vantage-compare", {a}).exit_code == 2);
  CHECK(run("vantage-compare", {a, (folder.path() / "none").string()}).exit_code == 1);
}

}  // namespace
}  // namespace vantage::test
