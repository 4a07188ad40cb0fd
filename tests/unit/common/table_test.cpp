#include "terminal/table.hpp"

#include <doctest/doctest.h>

using namespace vantage::cli;

namespace {

TextTable example() {
  TextTable table({"run", "error [cm]", "scans"});
  table.add({"L10", "1.25", "40"});
  table.add({"wide map", "10.50", "1,040"});
  return table;
}

}  // namespace

TEST_CASE("names are flush left, numbers flush right") {
  CHECK(example().to_string() ==
        "run       error [cm]  scans\n"
        "---------------------------\n"
        "L10             1.25     40\n"
        "wide map       10.50  1,040\n");
}

TEST_CASE("on a terminal the header is bold and the rule dim; columns stay where they are") {
  CHECK(example().to_string(Style(true, 80)) ==
        "\033[1mrun       error [cm]  scans\033[0m\n"
        "\033[2m---------------------------\033[0m\n"
        "L10             1.25     40\n"
        "wide map       10.50  1,040\n");
}

TEST_CASE("cells that are coloured or not ASCII are as wide as they look") {
  const Style style(true, 0);
  TextTable table({"gate", "verdict", "n"});
  table.add(
      {"gr\xc3\xb6\xc3\x9f"
       "e",
       style.good("pass"), "1"});
  table.add({"error", style.bad("FAIL"), "22"});
  CHECK(table.to_string() ==
        "gate   verdict   n\n"
        "------------------\n"
        "gr\xc3\xb6\xc3\x9f"
        "e     \033[1;32mpass\033[0m   1\n"
        "error     \033[1;31mFAIL\033[0m  22\n");
}

TEST_CASE("a table wider than the terminal becomes several, each with the names") {
  CHECK(example().to_string(Style(false, 26)) ==
        "run       error [cm]\n"
        "--------------------\n"
        "L10             1.25\n"
        "wide map       10.50\n"
        "\n"
        "run       scans\n"
        "---------------\n"
        "L10          40\n"
        "wide map  1,040\n");
  CHECK(example().to_string(Style(false, 27)) == example().to_string());
  SUBCASE("with at least one column, however narrow it is") {
    CHECK(example().to_string(Style(false, 1)) == example().to_string(Style(false, 26)));
  }
}

TEST_CASE("a table of names alone is never cut") {
  TextTable table({"kind", "file"}, 2);
  table.add({"matcher", "a/long/path"});
  CHECK(table.to_string(Style(false, 5)) ==
        "kind     file\n"
        "--------------------\n"
        "matcher  a/long/path\n");
}

TEST_CASE("a table without rows is its header") {
  CHECK(TextTable({"a", "b"}).to_string() == "a  b\n----\n");
}

TEST_CASE("thousands are told apart") {
  CHECK(grouped(0) == "0");
  CHECK(grouped(999) == "999");
  CHECK(grouped(1000) == "1,000");
  CHECK(grouped(1234567) == "1,234,567");
  CHECK(counted(0, "scan") == "0 scans");
  CHECK(counted(1, "scan") == "1 scan");
  CHECK(counted(1234, "scan") == "1,234 scans");
  CHECK(counted(2, "switch", "switches") == "2 switches");
  CHECK(form(1, "was", "were") == "was");
}
