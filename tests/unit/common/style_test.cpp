#include "terminal/style.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include "terminal/command_line.hpp"

using namespace vantage;
using namespace vantage::cli;

TEST_CASE("a style that is off leaves text alone") {
  const Style plain;
  CHECK(plain.good("ok") == "ok");
  CHECK(plain.bad("no") == "no");
  CHECK(plain.dim("-") == "-");
  CHECK(plain.bold("x") == "x");
}

TEST_CASE("a style that is on gives four different looks and always ends them") {
  const Style style(true, 0);
  CHECK(style.good("ok") == "\033[1;32mok\033[0m");
  CHECK(style.bad("no") == "\033[1;31mno\033[0m");
  CHECK(style.dim("-") == "\033[2m-\033[0m");
  CHECK(style.bold("x") == "\033[1mx\033[0m");
  CHECK(style.bold("").empty());
}

TEST_CASE("colours are for a terminal that knows them and a person who wants them") {
  CHECK(wants_color(true, "xterm", std::nullopt));
  CHECK(wants_color(true, "xterm", ""));  // set to nothing is not set
  CHECK_FALSE(wants_color(false, "xterm", std::nullopt));
  CHECK_FALSE(wants_color(true, "dumb", std::nullopt));
  CHECK_FALSE(wants_color(true, std::nullopt, std::nullopt));
  CHECK_FALSE(wants_color(true, "xterm", "1"));
}

TEST_CASE("always and never hold on any stream; a file has no width") {
  const int null = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  REQUIRE(null >= 0);
  CHECK(Style::of(null, "always").colored());
  CHECK_FALSE(Style::of(null, "never").colored());
  CHECK_FALSE(Style::of(null, "auto").colored());
  CHECK(Style::of(null, "always").columns() == 0);
  CHECK_FALSE(can_redraw(null));
  ::close(null);
}

TEST_CASE("the width of text is what is seen of it") {
  CHECK(display_width("abc") == 3);
  CHECK(display_width(Style(true, 0).good("abc")) == 3);
  CHECK(display_width("gr\xc3\xb6\xc3\x9f"
                      "e") == 5);
  CHECK(display_width("\033[unfinished") == 0);
}

TEST_CASE("an error is red in its word, wherever that stands") {
  Error error{.code = ErrorCode::internal,
              .message = "no error: none",
              .where = SourceLocation{"an error: file", 3, 4},
              .context = {}};
  CHECK(to_string(error, Style()) == vantage::to_string(error));
  CHECK(to_string(error, Style(true, 0)) ==
        "an error: file:3:4: \033[1;31merror:\033[0m no error: none");
  error.where.reset();
  CHECK(to_string(error, Style(true, 0)) == "\033[1;31merror:\033[0m no error: none");
}
