#pragma once

#include <map>
#include <string>
#include <vector>

namespace vantage::test {

/// Whether programs can be run on a terminal here; where they cannot, a line on stdout says that
/// the test was skipped, and why.
[[nodiscard]] bool terminals_exist();

/// All that a built program writes to a terminal of so many columns. An exception where there are
/// no terminals.
[[nodiscard]] std::string on_terminal(const std::string& program,
                                      std::vector<std::string> arguments, unsigned short columns,
                                      const std::map<std::string, std::string>& environment);

}  // namespace vantage::test
