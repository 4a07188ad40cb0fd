#include "live/live_params.hpp"

#include <doctest/doctest.h>

#include "support/process.hpp"
#include "vantage/engine/config.hpp"

namespace vantage::live {
namespace {

Result<LiveParams> params_of(const std::string& text) {
  return parse<LiveParams>(parse_toml(text, "live.toml").value());
}

TEST_CASE("[live] without a key listens to /points and publishes map -> base_link") {
  const auto params = params_of("");
  REQUIRE(params);
  CHECK(params->topics.points == "/points");
  CHECK(params->transform_in_use() == Transform::map_to_base);
  CHECK(params_of("topics = { odometry = \"/odom\" }")->transform_in_use() ==
        Transform::map_to_odom);
}

TEST_CASE("keys that contradict each other are refused, with their place") {
  const auto refused = [](const std::string& text, const std::string& message) {
    CAPTURE(text);
    const auto params = params_of(text);
    REQUIRE_FALSE(params);
    CHECK(to_string(params.error()).find(message) != std::string::npos);
  };
  refused("transform = \"map_to_odom\"", "live.toml:1:13: error: 'map_to_odom' needs the topic");
  refused("topics = { points = \"\" }", "'points' is empty");
  refused("start = \"wait\"\ntopics = { initial_pose = \"\" }", "'wait' needs the topic");
  refused("frames = { T_base_sensor = [1.0] }", "has 1 numbers, expected 6");
  refused("frames = { odom = \"map\" }", "must be different frames");
  refused("domain = 233", "domain");
  refused("topic = {}", "topic");
}

TEST_CASE("docs/live.md lists every key") {
  const std::string page = test::read_text(std::string(VANTAGE_SOURCE_DIR) + "/docs/live.md");
  const auto listed = [&](const std::vector<ParameterDoc>& keys, const auto& again) -> void {
    for (const ParameterDoc& key : keys) {
      CAPTURE(key.key);
      CHECK(page.find("| `" + key.key + "`") != std::string::npos);
      if (key.kind != ValueKind::table) CHECK(page.find(key.doc) != std::string::npos);
      again(key.fields, again);
    }
  };
  listed(describe<LiveParams>(), listed);
}

}  // namespace
}  // namespace vantage::live
