#include "report/html.hpp"

#include <doctest/doctest.h>

#include "report/assets.hpp"

namespace vantage::report {
namespace {

TEST_CASE("text cannot become markup, in elements and in attributes") {
  CHECK(escaped("<a href=\"x\" id='y'>&") == "&lt;a href=&quot;x&quot; id=&#39;y&#39;&gt;&amp;");
  CHECK(escaped(std::string("a\0b\x1b[31m\x7f", 9)) == "a b [31m ");
  CHECK(escaped("Zoë °") == "Zoë °");
}

TEST_CASE("a cell carries its data; the best is marked; a heading spans the table") {
  const Table table{.caption = "c<",
                    .header = {"name", "x [m]"},
                    .rows = {{.cells = {{"route <1>"}}, .heading = true},
                             {.cells = {{"a"}, {"1.0", {{"value", "0.99\""}}, true}}}}};
  const std::string html = to_html(table);
  CHECK(html.find("<td class=\"best\" data-value=\"0.99&quot;\">1.0</td>") != std::string::npos);
  CHECK(html.find("colspan=\"2\">route &lt;1&gt;</th>") != std::string::npos);
  CHECK(html.find("<caption>c&lt;</caption>") != std::string::npos);
}

TEST_CASE("every file that pages need is compiled in, and none ends a script before its end") {
  for (const char* name :
       {"base.css", "style.css", "page.js", "view3d.js", "three.min.js", "OrbitControls.js"}) {
    CAPTURE(name);
    const std::string_view text = asset(name);
    CHECK(text.size() > 1000);
    CHECK(text.find("</script") == std::string_view::npos);
    CHECK(text.find("</style") == std::string_view::npos);
    CHECK(text.find("<!--") == std::string_view::npos);
  }
  CHECK(asset("three.min.js").find("OrthographicCamera") != std::string_view::npos);
  CHECK(asset("no such file").empty());
}

TEST_CASE("our own scripts and styles ask for nothing") {
  for (const char* name :
       {"base.css", "style.css", "theme.js", "heights.js", "page.js", "view3d.js"}) {
    const std::string_view text = asset(name);
    CAPTURE(name);
    for (const char* word :
         {"fetch(", "XMLHttpRequest", "@import", "import(", "WebSocket", "https:"}) {
      CAPTURE(word);
      CHECK(text.find(word) == std::string_view::npos);
    }
  }
}

}  // namespace
}  // namespace vantage::report
