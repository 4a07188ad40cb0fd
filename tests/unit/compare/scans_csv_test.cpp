#include "vantage/evaluation/scan_table.hpp"

#include <doctest/doctest.h>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "tiny_scans.hpp"

namespace vantage {
namespace {

using test::tiny_csv;

TEST_CASE("cells in quotes hold commas, quotes and line ends; lines are counted") {
  const auto csv = parse_csv("a,b\r\n\"x, \"\"y\"\"\nz\",1\n,2", "f.csv");
  REQUIRE_MESSAGE(csv, to_string(csv.error()));
  CHECK(csv->header == std::vector<std::string>{"a", "b"});
  REQUIRE(csv->rows.size() == 2);
  CHECK(csv->rows[0].cells[0] == "x, \"y\"\nz");
  CHECK(csv->rows[0].line == 2);
  CHECK(csv->rows[1].cells == std::vector<std::string>{"", "2"});
  CHECK(csv->rows[1].line == 4);
}

TEST_CASE("a file that is no table is an error with its line") {
  const auto error = [](const char* text) {
    const auto csv = parse_csv(text, "f.csv");
    return csv ? std::string("no error") : to_string(csv.error());
  };
  CHECK(error("") == "f.csv:1: error: no header");
  CHECK(error("a,b\n1,2\n1\n") == "f.csv:3: error: 1 cells; the header has 2");
  CHECK(error("a,b\n1,2,3\n") == "f.csv:2: error: 3 cells; the header has 2");
  CHECK(error("a,b\n1,\"2\n\n") == "f.csv:2: error: a quote that is never closed");
  CHECK(error("a,b\n1,\"2\"3\n") == "f.csv:2: error: text after the closing quote of a cell");
  CHECK(error("a,b\n1,2\"3\n") == "f.csv:2: error: a quote inside a cell without quotes");
  CHECK(error("a,a\n") == "f.csv:1: error: column 'a' is there twice");
}

struct File {
  test::TemporaryFolder folder;
  std::filesystem::path path = folder.path() / "scans.csv";

  std::string error(const std::string& content) {
    test::write_text(path, content);
    const auto scans = read_scans(path);
    if (scans) return "no error";
    std::string text = to_string(scans.error());
    return text.substr(text.find("scans.csv"));
  }
};

TEST_CASE_FIXTURE(File, "columns are found by name; empty cells are no numbers") {
  test::write_text(path, tiny_csv({{.stamp = "1.5"},
                                   {.stamp = "2.5", .tracking = "lost", .error_m = ""},
                                   {.stamp = "3.5", .tracking = "uncertain"}}));
  for (const auto& given : {path, folder.path()}) {
    const auto scans = read_scans(given);
    REQUIRE_MESSAGE(scans, to_string(scans.error()));
    CHECK(scans->stamps == std::vector<double>{1.5, 2.5, 3.5});
    CHECK(scans->tracking == std::vector{Tracking::tracked, Tracking::lost, Tracking::uncertain});
    CHECK(scans->is_tracked(0));
    CHECK_FALSE(scans->is_tracked(1));
    CHECK_FALSE(scans->is_tracked(2));
    CHECK(scans->columns.at("risk")[0] == 0.5);
    CHECK(scans->columns.at("error_m")[0] == 0.01);
    CHECK_FALSE(scans->columns.at("error_m")[1]);
    CHECK(scans->lines == std::vector<std::uint32_t>{2, 3, 4});
  }
}

TEST_CASE_FIXTURE(File, "what is no scans.csv is an error with its line") {
  CHECK(error("stamp,tracking\n1,tracked\n") ==
        "scans.csv:1: error: no column 'distance_m'; expected scans.csv of `vantage localize` "
        "of this version: localize again if an earlier version wrote it");
  CHECK(error(tiny_csv({})) == "scans.csv:1: error: no scan");
  CHECK(error(tiny_csv({{.stamp = "1"}, {.stamp = "x"}})) ==
        "scans.csv:3: error: 'x' in column 'stamp' is not a finite number");
  CHECK(error(tiny_csv({{.stamp = "1"}, {.stamp = "1"}})) ==
        "scans.csv:3: error: the stamp 1 is not after the one before, 1");
  CHECK(error(tiny_csv({{.stamp = ""}})) == "scans.csv:2: error: no stamp");
  CHECK(error(tiny_csv({{.stamp = "1", .error_m = "nan"}})) ==
        "scans.csv:2: error: 'nan' in column 'error_m' is not a finite number");
  CHECK(error(tiny_csv({{.stamp = "1", .tracking = "maybe"}})) ==
        "scans.csv:2: error: 'maybe' in column 'tracking'; expected tracked, uncertain or lost");
}

TEST_CASE_FIXTURE(File, "a scans.csv from before there was a risk is read without one") {
  const std::string csv = tiny_csv({{.stamp = "1"}, {.stamp = "2", .tracking = "lost"}});
  const auto table = parse_csv(csv, "scans.csv");
  REQUIRE(table);
  std::string old;
  const auto add = [&](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (table->header[i] == "risk") continue;
      old += (i == 0 ? "\"" : ",\"") + cells[i] + '"';
    }
    old += '\n';
  };
  add(table->header);
  for (const auto& row : table->rows) {
    std::vector<std::string> cells = row.cells;
    cells.front() = "reason";  // has quotes otherwise
    add(cells);
  }
  REQUIRE(old.find("risk") == std::string::npos);
  test::write_text(path, old);
  const auto scans = read_scans(path);
  REQUIRE_MESSAGE(scans, to_string(scans.error()));
  REQUIRE(scans->columns.at("risk").size() == 2);
  CHECK_FALSE(scans->columns.at("risk")[0]);
  CHECK(scans->columns.at("nvtl")[0] == 0.5);
  CHECK(scans->tracking == std::vector{Tracking::tracked, Tracking::lost});
}

TEST_CASE("a folder without scans.csv: those below that hold one are named") {
  const test::TemporaryFolder folder;
  CHECK(
      to_string(read_scans(folder.path()).error()).ends_with("error: no scans.csv in this folder"));
  std::filesystem::create_directories(folder.path() / "L20" / "north");
  test::write_text(folder.path() / "L20" / "north" / "scans.csv", tiny_csv({{.stamp = "1"}}));
  CHECK(to_string(read_scans(folder.path()).error()).ends_with("; its folder L20/north holds one"));
  CHECK_FALSE(read_scans(folder.path() / "none.csv"));
}

}  // namespace
}  // namespace vantage
