#include "vantage/kit/json_text.hpp"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace vantage {
namespace {

TEST_CASE("the depth of a JSON text counts brackets outside of strings") {
  CHECK(json_depth("") == 0);
  CHECK(json_depth("7") == 0);
  CHECK(json_depth("[]") == 1);
  CHECK(json_depth("{\"a\": [1, [2]], \"b\": [3]}") == 3);
  CHECK(json_depth("[\"[[[[\\\"[[\", \"\\\\\", [\"{{\"]]") == 2);
  CHECK(json_depth(std::string(200'000, '[')) == 200'000);
  CHECK(json_depth("]]]][") == 1);
}

TEST_CASE("JSON that is nested too deep is refused, and anything else that is none") {
  const auto nested = [](std::size_t depth) {
    return std::string(depth, '[') + std::string(depth, ']');
  };
  const auto deepest = parse_json<nlohmann::json>(nested(kDeepestJson), "a.json", "damaged");
  REQUIRE_MESSAGE(deepest, to_string(deepest.error()));
  CHECK(deepest->dump() == nested(kDeepestJson));
  const auto refused = [](const std::string& text, const std::string& line) {
    const auto read = parse_json<nlohmann::ordered_json>(text, "a.json", "damaged");
    REQUIRE_FALSE(read);
    CHECK(read.error().code == ErrorCode::corrupt_data);
    CHECK_MESSAGE(to_string(read.error()).starts_with(line), to_string(read.error()));
  };
  refused(nested(kDeepestJson + 1), "a.json: error: damaged: it is not JSON of at most 64 levels");
  refused(nested(1'000'000), "a.json: error: damaged: it is not JSON of at most 64 levels");
  refused("{\n  \"a\": 1,\n  b\n}", "a.json:3:3: error: damaged: it is not JSON");
  refused("", "a.json:1:1: error: damaged: it is not JSON");
  refused("1e999", "a.json: error: damaged: ");
}

TEST_CASE("JSON is written whatever bytes are in its texts") {
  const nlohmann::ordered_json json{{"path", "/m\xe9tro/a.pcd"}, {"count", 2}};
  CHECK(json_line(json) == "{\"path\":\"/m\uFFFDtro/a.pcd\",\"count\":2}");
  CHECK(json_text(json) == "{\n  \"path\": \"/m\uFFFDtro/a.pcd\",\n  \"count\": 2\n}\n");
  CHECK(json_line(nlohmann::json("\xc3\xa9")) == "\"\xc3\xa9\"");
}

}  // namespace
}  // namespace vantage
