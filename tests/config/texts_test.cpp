// The texts made of parameters, with parameters that no shipped plugin has.
#include <doctest/doctest.h>

#include <algorithm>

#include "plugins/json_schema.hpp"
#include "plugins/text.hpp"
#include "support/plugins.hpp"
#include "support/text.hpp"
#include "vantage/engine/config.hpp"

using namespace vantage;

namespace {

using test::has;

enum class Side : std::uint8_t { left, right };
constexpr auto enum_names(Side) {
  return std::array{std::pair{std::string_view("l|eft"), Side::left},
                    std::pair{std::string_view("right"), Side::right}};
}

struct Inner {
  double depth = 2.5;
  static constexpr auto schema() {
    return std::tuple{optional("depth", &Inner::depth, "m", "how deep", between(0, 10))};
  }
};

struct Odd {
  std::string text = "a|b`c\n";
  std::vector<std::string> words;
  std::optional<std::vector<Side>> sides;
  Inner inner;
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();
  std::int8_t tiny = 1;
  bool flag{};

  static constexpr auto schema() {
    return std::tuple{
        optional("text", &Odd::text, "|", "one | two\nthree <b>", Source{"Eq. |"}),
        required("words", &Odd::words, "", "some"),
        optional("sides", &Odd::sides, "", "none if left out"),
        optional("inner", &Odd::inner, "", "nested"),
        optional("corner", &Odd::corner, "m", "where", at_least(-1)),
        optional("tiny", &Odd::tiny, "", "small"),
        required("flag", &Odd::flag, "", "whether"),
    };
  }
};

PluginInfo odd() {
  return {.kind = PluginKind::ground,
          .name = "odd",
          .summary = "a | b",
          .path = "/somewhere/odd.so",
          .parameters = describe<Odd>()};
}

}  // namespace

TEST_CASE("reference: bars, breaks and tags in a text do not break its table") {
  const std::string text = documentation::reference({}, {odd()});
  CHECK(has(text,
            "| `text` | string | \\| | `` \"a\\|b`c\\n\" `` | | one \\| two three \\<b\\> | Eq. "
            "\\| |\n"));
  CHECK(
      has(text, "| `sides` | array of choices | | | `l\\|eft`, `right` | none if left out | |\n"));
  CHECK(has(text, "\nA \\| b.\n"));
  CHECK(has(text, "\n### [ground.params.inner]\n\nNested.\n"));
  CHECK_FALSE(has(text, "/somewhere"));
}

TEST_CASE("JSON Schema: nested tables, arrays of strings and choices, small integers") {
  const auto schema = documentation::json_schema(odd());
  const auto& properties = schema["properties"];
  CHECK(schema["required"] == nlohmann::ordered_json{"words", "flag"});
  CHECK(properties["words"]["items"]["type"] == "string");
  CHECK_FALSE(properties["words"].contains("minItems"));
  CHECK(properties["sides"]["items"]["enum"].size() == 2);
  CHECK_FALSE(properties["sides"].contains("default"));
  CHECK(properties["inner"]["type"] == "object");
  CHECK(properties["inner"]["properties"]["depth"]["maximum"] == 10.0);
  CHECK(properties["inner"]["additionalProperties"] == false);
  CHECK(properties["inner"]["default"]["depth"] == 2.5);
  CHECK(properties["corner"]["items"]["minimum"] == -1.0);
  CHECK(properties["corner"]["minItems"] == 3);
  CHECK(properties["corner"]["default"] == nlohmann::ordered_json{0.0, 0.0, 0.0});
  CHECK(properties["tiny"]["minimum"] == -128);
  CHECK(properties["tiny"]["maximum"] == 127);
  CHECK(properties["flag"]["type"] == "boolean");
}

TEST_CASE("template: every kind of placeholder is refused, at its line") {
  std::string toml = documentation::toml_template(odd());
  for (const char* key : {"words", "flag"}) {
    const auto root = parse_toml(toml, "t.toml");
    REQUIRE_MESSAGE(root, to_string(root.error()));
    const auto& section = std::get<Table>(root->find("ground")->data);
    const auto params = parse<Odd>(std::get<Table>(section.find("params")->data));
    REQUIRE_FALSE(params);
    const auto line =
        1 + std::count(toml.begin(),
                       toml.begin() + static_cast<std::ptrdiff_t>(
                                          toml.find("\n" + std::string(key) + " = ") + 1),
                       '\n');
    CHECK(params.error().where->line == line);
    const std::size_t at = toml.find("\"FILL IN\"", toml.find("\n" + std::string(key) + " = "));
    toml.replace(at, 9, std::string(key) == "words" ? "[]" : "true");
  }
  const auto root = parse_toml(toml, "t.toml");
  REQUIRE(root);
  const auto& section = std::get<Table>(root->find("ground")->data);
  const auto params = parse<Odd>(std::get<Table>(section.find("params")->data));
  REQUIRE_MESSAGE(params, to_string(params.error()));
  CHECK(params->flag);
  CHECK_FALSE(params->sides);
}
