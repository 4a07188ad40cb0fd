#include "localize/verdict_constants.hpp"

#include <doctest/doctest.h>

#include <set>
#include <sstream>
#include <string>

#include "support/process.hpp"

using namespace vantage;

TEST_CASE("docs/localization.md has the table of the constants that decide a verdict") {
  std::ostringstream table;
  table << "| constant | value | unit | what it is | chosen on |\n|---|---:|---|---|---|\n";
  std::set<std::string_view> names;
  for (const VerdictConstant& row : kVerdictConstants) {
    table << "| `" << row.name << "` | " << row.value << " | " << row.unit << " | " << row.meaning
          << " | " << row.chosen_on << " |\n";
    CHECK(names.insert(row.name).second);
  }
  table << '\n';  // and no other row
  const std::string docs = test::read_text(VANTAGE_SOURCE_DIR "/docs/localization.md");
  CHECK_MESSAGE(docs.find(table.str()) != std::string::npos,
                "docs/localization.md lacks this table:\n"
                    << table.str());
}
