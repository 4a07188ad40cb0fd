#include "terminal/progress.hpp"

#include <doctest/doctest.h>

using namespace vantage::cli;

TEST_CASE("a line of progress: what is done, the time it took and what is left of it") {
  CHECK(progress_line("scans", 300, 1000, 65.0) == "scans: 300/1,000  30 %  1:05, 2:32 left");
  CHECK(progress_line("scans", 1, 77, 0.4) == "scans: 1/77  1 %  0:00, 0:30 left");
  CHECK(progress_line("scans", 10, 1000, 3600.0) == "scans: 10/1,000  1 %  1:00:00, 99:00:00 left");
}

TEST_CASE("nothing is said of the time to go before the first and after the last") {
  CHECK(progress_line("scans", 0, 10, 12.0) == "scans: 0/10  0 %  0:12");
  CHECK(progress_line("scans", 10, 10, 59.6) == "scans: 10/10  100 %  1:00");
}

TEST_CASE("100 % is all of it, not nearly") {
  CHECK(progress_line("q", 99'999, 100'000, 10.0) == "q: 99,999/100,000  99 %  0:10, 0:00 left");
}

TEST_CASE("the bar of a terminal fills from the left") {
  CHECK(progress_bar("q", 0, 4, 0.0) == "q [..............................] 0/4  0 %  0:00");
  CHECK(progress_bar("q", 1, 2, 5.0) ==
        "q [###############...............] 1/2  50 %  0:05, 0:05 left");
  CHECK(progress_bar("q", 4, 4, 1.0) == "q [##############################] 4/4  100 %  0:01");
}

TEST_CASE("a file gets one line a tenth, however many updates there are") {
  ProgressLines lines;
  int printed = 0;
  for (std::size_t done = 0; done <= 100'000; ++done) {
    printed += lines.due(done, 100'000, 1e-3 * static_cast<double>(done)) ? 1 : 0;
  }
  CHECK(printed == 10);
}

TEST_CASE("a file gets a line every five minutes where a tenth takes longer") {
  ProgressLines lines;
  CHECK_FALSE(lines.due(1, 1000, 299.0));
  CHECK(lines.due(2, 1000, 301.0));
  CHECK_FALSE(lines.due(3, 1000, 600.0));
  CHECK(lines.due(4, 1000, 601.0));
  CHECK(lines.due(100, 1000, 602.0));  // a tenth
  CHECK_FALSE(lines.due(101, 1000, 603.0));
}

TEST_CASE("where nobody knows how much there is: what is done and the time it took") {
  CHECK(progress_line("scans", 300, 0, 65.0) == "scans: 300  1:05");
  CHECK(progress_bar("scans", 300, 0, 65.0) == "scans: 300  1:05");
  ProgressLines lines;
  CHECK_FALSE(lines.due(999, 0, 1.0));
  CHECK(lines.due(1000, 0, 2.0));
  CHECK_FALSE(lines.due(1001, 0, 3.0));
  CHECK(lines.due(1002, 0, 303.0));
}
