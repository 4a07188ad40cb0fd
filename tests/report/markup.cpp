#include "report/markup.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <regex>
#include <set>
#include <vector>

namespace vantage::test {

std::string markup_of(const std::string& page) {
  std::string rest;
  std::size_t at = 0;
  while (true) {
    std::size_t open = std::string::npos;
    std::string name;
    for (const char* element : {"script", "style"}) {
      const auto found = page.find("<" + std::string(element), at);
      if (found < open) {
        open = found;
        name = element;
      }
    }
    if (open == std::string::npos) return rest + page.substr(at);
    const auto content = page.find('>', open) + 1;
    rest += page.substr(at, content - at);
    at = page.find("</" + name + ">", content);
    REQUIRE(at != std::string::npos);
  }
}

std::string imbalance(const std::string& markup) {
  static const std::set<std::string> kVoid{"meta", "link", "br", "input"};
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-zA-Z][a-zA-Z0-9]*)((?:[^>\"]|\"[^\"]*\")*)>");
  for (std::sregex_iterator it(markup.begin(), markup.end(), tag), end; it != end; ++it) {
    const std::string name = (*it)[2], rest = (*it)[3];
    if ((*it)[1] == "/") {
      if (open.empty() || open.back() != name) {
        return "</" + name + "> inside <" + (open.empty() ? "" : open.back()) + ">";
      }
      open.pop_back();
    } else if (!kVoid.contains(name) && !rest.ends_with("/")) {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "<" + open.back() + "> is never closed";
}

std::string invalid_html(const std::string& markup) {
  const std::regex end_tag("</[a-zA-Z][a-zA-Z0-9]*[^>a-zA-Z0-9][^>]*>");
  if (std::smatch found; std::regex_search(markup, found, end_tag)) {
    return found.str() + " is no end tag";
  }
  static const std::map<std::string, std::set<std::string>> kParents{
      {"li", {"ul", "ol"}},       {"dt", {"dl"}},          {"dd", {"dl"}},
      {"tr", {"thead", "tbody"}}, {"th", {"tr"}},          {"td", {"tr"}},
      {"thead", {"table"}},       {"tbody", {"table"}},    {"caption", {"table"}},
      {"figcaption", {"figure"}}, {"summary", {"details"}}};
  static const std::set<std::string> kBlocks{"p",     "div",    "ul",      "ol",     "dl",
                                             "table", "figure", "section", "h1",     "h2",
                                             "h3",    "pre",    "details", "header", "nav"};
  static const std::set<std::string> kVoid{"meta", "link", "br", "input"};
  std::set<std::string> ids;
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-zA-Z][a-zA-Z0-9]*)((?:[^>\"]|\"[^\"]*\")*)>");
  const std::regex attribute("([a-zA-Z:-]+)(?:=(\"[^\"]*\"))?");
  for (std::sregex_iterator it(markup.begin(), markup.end(), tag), end; it != end; ++it) {
    const std::string name = (*it)[2], rest = (*it)[3];
    if ((*it)[1] == "/") {
      open.pop_back();
      continue;
    }
    const std::string parent = open.empty() ? "" : open.back();
    if (const auto parents = kParents.find(name);
        parents != kParents.end() && !parents->second.contains(parent)) {
      return "<" + name + "> in <" + parent + ">";
    }
    if (kBlocks.contains(name) && std::find(open.begin(), open.end(), "p") != open.end()) {
      return "<" + name + "> in <p>";
    }
    std::set<std::string> names;
    for (std::sregex_iterator a(rest.begin(), rest.end(), attribute); a != end; ++a) {
      const std::string key = (*a)[1], value = (*a)[2];
      if (!names.insert(key).second) return key + " is there twice in <" + name + rest + ">";
      if (key == "id" && !ids.insert(value).second) return "id " + value + " is there twice";
    }
    if (!kVoid.contains(name) && !rest.ends_with("/")) open.push_back(name);
  }
  return {};
}

}  // namespace vantage::test
