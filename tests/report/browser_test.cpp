// The page of an evaluation in a headless Chromium: it asks the network for nothing and its scripts
// run. Without a Chromium the program ends with exit code 4, which ctest counts as skipped.
#include <doctest/doctest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <sstream>

#include "evaluate/report.hpp"
#include "report/evaluation_fixture.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::test {
namespace {

namespace fs = std::filesystem;

constexpr int kSkipped = 4;

std::optional<fs::path> browser() {
  for (const char* path :
       {"/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"}) {
    if (access(path, X_OK) == 0) return path;
  }
  return std::nullopt;
}

struct Visit {
  std::string dom;       ///< after scripts
  std::string requests;  ///< URLs that the page asked the network for
  std::string console;   ///< what scripts and the browser said of the page
};

Visit visit(const std::string& page, const std::string& more = "--disable-extensions") {
  const auto chromium = browser();
  if (!chromium) {
    std::cout << "SKIPPED: no Chromium to open reports in" << std::endl;
    std::_Exit(kSkipped);
  }
  const TemporaryFolder folder;
  write_text(folder.path() / "page.html", page);
  const std::string log = (folder.path() / "net.json").string();
  const auto done = run(
      chromium->string(),
      {"--headless", "--no-sandbox", "--disable-gpu-sandbox", "--use-gl=angle",
       "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking",
       "--disable-component-update", "--disable-sync", "--no-first-run", more,
       "--user-data-dir=" + (folder.path() / "profile").string(), "--log-net-log=" + log,
       "--enable-logging=stderr", "--v=0", "--window-size=1200,1500", "--virtual-time-budget=5000",
       "--dump-dom", "file://" + (folder.path() / "page.html").string() + "#view"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  Visit result{.dom = done.out, .requests = {}, .console = {}};
  const std::string net = read_text(log);
  // An event a line. What a page asks for has the page as its initiator; the browser has errands
  // of its own.
  std::istringstream events(net);
  for (std::string event; std::getline(events, event);) {
    const auto url = event.find("\"url\":\"");
    if (event.find("\"initiator\":\"") == std::string::npos || url == std::string::npos) continue;
    if (event.find("\"initiator\":\"not an origin\"") != std::string::npos) continue;
    const std::string to = event.substr(url + 7, event.find('"', url + 7) - url - 7);
    if (!to.starts_with("file:") && !to.starts_with("data:") && !to.starts_with("blob:")) {
      result.requests += to + "\n";
    }
  }
  std::istringstream lines(done.err);
  for (std::string line; std::getline(lines, line);) {
    if (line.find("CONSOLE") != std::string::npos) result.console += line + "\n";
  }
  return result;
}

std::string page() {
  auto text = to_html(made_evaluation({}));
  REQUIRE(text);
  return *std::move(text);
}

TEST_CASE("the page asks for nothing, its scripts run without errors, the 3-D view draws") {
  const std::string text = page();
  Visit seen = visit(text);
  // A busy machine may give a page no WebGL because its software renderer did not start in time.
  for (int again = 0; again < 2 && seen.dom.find("<canvas") == std::string::npos; ++again) {
    seen = visit(text);
  }
  CHECK(seen.requests == "");
  CHECK(seen.console == "");
  CHECK(seen.dom.find("<canvas") != std::string::npos);
  CHECK(seen.dom.find("id=\"theme\">Dark</button>") != std::string::npos);
  CHECK(seen.dom.find("data-tip=") != std::string::npos);
}

TEST_CASE("without WebGL the page says so where the view would be") {
  const Visit seen = visit(page(), "--disable-3d-apis");
  CHECK(seen.dom.find("This browser shows no WebGL") != std::string::npos);
  CHECK(seen.dom.find("<canvas") == std::string::npos);
}

TEST_CASE("a page that asks, or whose script fails, would be noticed") {
  std::string broken = page();
  const std::string end = "</main>";
  const auto at = broken.find(end);
  broken.insert(at,
                "<script>no_such_function();</script><img src=\"http://vantage.invalid/x.png\">");
  SUBCASE("its policy forbids the request") {
    const Visit seen = visit(broken);
    CHECK(seen.requests == "");
    CHECK(seen.console.find("no_such_function") != std::string::npos);
    CHECK(seen.console.find("Content Security Policy") != std::string::npos);
  }
  SUBCASE("without a policy the request is made") {
    const std::string policy = "Content-Security-Policy";
    broken.replace(broken.find(policy), policy.size(), "X-Nothing");
    CHECK(visit(broken).requests.find("vantage.invalid") != std::string::npos);
  }
}

}  // namespace
}  // namespace vantage::test
