#include "foxglove/hub.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "io/ros/messages.hpp"
#include "io/ros/schemas.hpp"
#include "protocol.hpp"

namespace vantage::foxglove {
namespace {

using test::data_of;
using test::Json;
using test::kMap;
using test::kRisk;
using test::kStatic;

/// A hub, its clients' wakes and the poses that it got.
struct Bench {
  explicit Bench(std::size_t most = 1U << 20U)
      : hub({.name = "robot",
             .session = "s",
             .initial_pose = "/initialpose",
             .metadata = {{"vantage.map", "/map"}},
             .most_waiting = most},
            [this](std::string&& pose) { poses.push_back(std::move(pose)); }) {}

  Hub::ClientId join() {
    const auto client = hub.join([this] { ++wakes; });
    drain(client);
    return client;
  }
  std::vector<Frame> drain(Hub::ClientId client) {
    std::vector<Frame> frames;
    while (auto frame = hub.next(client)) frames.push_back(*std::move(frame));
    return frames;
  }
  /// The one text that waits.
  Json answer(Hub::ClientId client) {
    const auto frames = drain(client);
    REQUIRE(frames.size() == 1);
    REQUIRE(frames[0].is_text);
    return Json::parse(frames[0].head);
  }
  test::Data data(const Frame& frame) { return data_of(frame.head + *frame.body); }

  std::vector<std::string> poses;
  int wakes = 0;
  Hub hub;
};

TEST_CASE("a client is told who the server is, then its channels") {
  Bench bench;
  bench.hub.see(kRisk, 1, "a");
  const auto client = bench.hub.join([] {});
  const auto frames = bench.drain(client);
  REQUIRE(frames.size() == 2);
  const Json info = Json::parse(frames[0].head), channels = Json::parse(frames[1].head);
  CHECK(info["op"] == "serverInfo");
  CHECK(info["name"] == "robot");
  CHECK(info["capabilities"] == Json{"clientPublish"});
  CHECK(info["supportedEncodings"] == Json{"cdr", "json"});
  CHECK(info["metadata"] == Json{{"ROS_DISTRO", "jazzy"}, {"vantage.map", "/map"}});
  CHECK(info["sessionId"] == "s");
  CHECK(channels["op"] == "advertise");
  REQUIRE(channels["channels"].size() == 1);
  const Json& risk = channels["channels"][0];
  CHECK(risk["topic"] == "/risk");
  CHECK(risk["encoding"] == "cdr");
  CHECK(risk["schemaName"] == "std_msgs/msg/Float64");
  CHECK(risk["schemaEncoding"] == "ros2msg");
  CHECK(risk["schema"] == io::ros::schema_of("std_msgs/Float64")->text);
}

TEST_CASE("without a topic for poses, clients cannot publish") {
  Hub hub({}, [](std::string&&) { FAIL("a pose"); });
  const auto client = hub.join([] {});
  const auto first = hub.next(client);
  REQUIRE(first);
  CHECK(Json::parse(first->head)["capabilities"].empty());
  CHECK_FALSE(Json::parse(first->head).contains("supportedEncodings"));
  CHECK(hub.text(client, test::advertise(1, "", "geometry_msgs/PoseStamped", "json")));
  CHECK_FALSE(hub.next(client));
  CHECK(hub.binary(client, test::message(1, test::pose_in_json().dump())));
  const auto refusal = hub.next(client);
  REQUIRE(refusal);
  CHECK(Json::parse(refusal->head)["message"] == "clients cannot publish here");
}

TEST_CASE("a channel that is new is announced to clients that are there, once") {
  Bench bench;
  const auto client = bench.join();
  bench.hub.see(kRisk, 1, "a");
  bench.hub.see(kRisk, 2, "b");
  CHECK(bench.answer(client)["channels"][0]["topic"] == "/risk");
  CHECK(bench.wakes == 1);
  bench.hub.see({.name = "/other", .type = "other_msgs/Unknown"}, 3, "c");
  CHECK(bench.drain(client).empty());
}

TEST_CASE("messages go to those who subscribed, until they do not want them any more") {
  Bench bench;
  const auto one = bench.join(), other = bench.join();
  bench.hub.see(kRisk, 1, "before");
  bench.drain(one);
  bench.drain(other);
  CHECK(bench.hub.text(one, test::subscribe(70'000, 1)));
  bench.hub.see(kRisk, 0x0102030405060708, "hello");
  const auto frames = bench.drain(one);
  REQUIRE(frames.size() == 1);
  CHECK_FALSE(frames[0].is_text);
  const auto data = bench.data(frames[0]);
  CHECK(data.opcode == 1);
  CHECK(data.subscription == 70'000);
  CHECK(data.time == 0x0102030405060708);
  CHECK(data.message == "hello");
  CHECK(bench.drain(other).empty());
  CHECK(bench.hub.text(one, R"({"op":"unsubscribe","subscriptionIds":[70000]})"));
  bench.hub.see(kRisk, 3, "after");
  CHECK(bench.drain(one).empty());
}

TEST_CASE("what is latched is kept for those who come later, as many as the topic keeps") {
  Bench bench;
  for (const char* const text : {"1", "2", "3", "4"}) bench.hub.see(kStatic, text[0], text);
  bench.hub.see(kMap, 5, "old");
  bench.hub.see(kMap, 6, "map");
  const auto client = bench.join();
  CHECK(bench.hub.text(client, test::subscribe(1, 1)));
  CHECK(bench.hub.text(client, test::subscribe(2, 2)));
  std::string got;
  for (const Frame& frame : bench.drain(client)) got += bench.data(frame).message;
  CHECK(got == "234map");
  // Once more for one who subscribes again.
  CHECK(bench.hub.text(client, R"({"op":"unsubscribe","subscriptionIds":[2]})"));
  CHECK(bench.hub.text(client, test::subscribe(3, 2)));
  const auto again = bench.drain(client);
  REQUIRE(again.size() == 1);
  CHECK(bench.data(again[0]).message == "map");
}

TEST_CASE("subscriptions that contradict each other are refused") {
  Bench bench;
  bench.hub.see(kRisk, 1, "");
  bench.hub.see(kMap, 1, "");
  const auto client = bench.join();
  const auto error = [&](const std::string& text) {
    CHECK(bench.hub.text(client, text));
    const Json status = bench.answer(client);
    CHECK(status["op"] == "status");
    CHECK(status["level"].get<int>() >= 1);
    return status["message"].get<std::string>();
  };
  CHECK(bench.hub.text(client, test::subscribe(1, 1)));
  CHECK(error(test::subscribe(2, 1)).find("subscribed already") != std::string::npos);
  CHECK(error(test::subscribe(1, 2)).find("taken") != std::string::npos);
  CHECK(error(test::subscribe(3, 9)).find("no channel 9") != std::string::npos);
  CHECK(error(test::subscribe(3, 0)).find("no channel 0") != std::string::npos);
  CHECK(error(R"({"op":"unsubscribe","subscriptionIds":[8]})").find("8") != std::string::npos);
}

TEST_CASE("a pose that a client publishes starts the localizer, others do not") {
  Bench bench;
  const auto client = bench.join();
  const auto begin = [&](std::uint32_t id, const std::string& topic, const std::string& type,
                         const std::string& encoding) {
    CHECK(bench.hub.text(client, test::advertise(id, topic, type, encoding)));
  };
  begin(7, "/initialpose", "geometry_msgs/PoseStamped", "json");
  // What panels announce is no error before they publish it.
  begin(8, "/goal", "geometry_msgs/PoseStamped", "json");
  begin(9, "/initialpose", "std_msgs/String", "json");
  begin(10, "/initialpose", "geometry_msgs/PoseStamped", "ros1");
  CHECK(bench.drain(client).empty());
  begin(7, "/initialpose", "geometry_msgs/PoseStamped", "json");
  CHECK(bench.answer(client)["message"].get<std::string>().find("taken") != std::string::npos);

  const std::string pose = test::pose_in_json().dump();
  CHECK(bench.hub.binary(client, test::message(7, pose)));
  REQUIRE(bench.poses.size() == 1);
  CHECK(io::ros::parse_poses(bench.poses[0], "geometry_msgs/PoseWithCovarianceStamped",
                             io::ros::Encoding::cdr, {}));
  CHECK(bench.drain(client).empty());
  const std::pair<std::string, const char*> refused[] = {
      {test::message(8, pose), "poses on '/initialpose' only"},
      {test::message(9, pose), "'std_msgs/String' in 'json' is no pose"},
      {test::message(10, pose), "in 'ros1' is no pose"},
      {test::message(7, "{}"), "no 'header'"},
      {test::message(7, ""), "no JSON object"},
      {"\1", "opcode"},
      {"", "opcode"},
      {"\2abcdefgh", "opcode"}};
  for (const auto& [frame, why] : refused) {
    CAPTURE(why);
    CHECK(bench.hub.binary(client, frame));
    const Json status = bench.answer(client);
    CHECK(status["level"] == 2);
    CHECK(status["message"].get<std::string>().find(why) != std::string::npos);
  }
  CHECK(bench.hub.text(client, R"({"op":"unadvertise","channelIds":[7,8]})"));
  CHECK(bench.drain(client).empty());
  CHECK(bench.hub.binary(client, test::message(7, pose)));
  CHECK(bench.answer(client)["level"] == 2);
  CHECK(bench.poses.size() == 1);
}

TEST_CASE("what is no request is refused") {
  Bench bench;
  const auto client = bench.join();
  for (const char* const text :
       {"", "{", "[]", "null", "{}", R"({"op":3})", R"({"op":"getParameters"})",
        R"({"op":"subscribe"})", R"({"op":"subscribe","subscriptions":{}})",
        R"({"op":"subscribe","subscriptions":[1]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})",
        R"({"op":"unsubscribe","subscriptionIds":["1"]})",
        R"({"op":"advertise","channels":[{"id":1,"topic":"/a"}]})", "\xff\xfe"}) {
    CAPTURE(text);
    CHECK(bench.hub.text(client, text));
    CHECK(bench.answer(client)["level"] == 2);
  }
}

TEST_CASE("a slow client loses the oldest messages, is told, and keeps the map") {
  Bench bench(10'000);
  bench.hub.see(kMap, 1, std::string(3000, 'm'));
  bench.hub.see(kRisk, 1, "");
  const auto client = bench.join();
  CHECK(bench.hub.text(client, test::subscribe(1, 1)));
  CHECK(bench.hub.text(client, test::subscribe(2, 2)));
  std::size_t most = 0;
  for (int i = 0; i < 100; ++i) {
    bench.hub.see(kRisk, i, std::string(1000, 'r'));
    most = std::max(most, bench.hub.waiting_bytes(client));
  }
  CHECK(most <= 10'000);
  CHECK(most > 8'000);
  std::size_t maps = 0, risks = 0, told = 0;
  std::uint64_t last = 0;
  for (const Frame& frame : bench.drain(client)) {
    if (frame.is_text) {
      const Json status = Json::parse(frame.head);
      CHECK(status["level"] == 1);
      CHECK(status["id"] == "left_out");
      ++told;
      continue;
    }
    const auto data = bench.data(frame);
    data.subscription == 1 ? ++maps : ++risks;
    CHECK(data.time >= last);
    last = data.time;
  }
  CHECK(told == 1);
  CHECK(maps == 1);
  CHECK(risks < 10);
  CHECK(last == 99);
  CHECK(bench.hub.waiting_bytes(client) == 0);
  // Told again after it had caught up.
  for (int i = 100; i < 120; ++i) bench.hub.see(kRisk, i, std::string(1000, 'r'));
  const auto warning = bench.hub.next(client);
  REQUIRE(warning);
  CHECK(warning->is_text);
  bench.drain(client);
  // A message that is larger than the limit goes alone.
  bench.hub.see(kMap, 200, std::string(50'000, 'M'));
  const auto frames = bench.drain(client);
  REQUIRE(frames.size() == 1);
  CHECK(bench.data(frames[0]).message.size() == 50'000);
}

TEST_CASE("a map larger than the buffer reaches a slow client, and drops nothing that is latched") {
  Bench bench(10'000);
  bench.hub.see(kMap, 1, "");
  bench.hub.see(kRisk, 1, "");
  bench.hub.see(kStatic, 1, "");
  const auto client = bench.join();
  for (const std::uint32_t id : {1U, 2U, 3U})
    CHECK(bench.hub.text(client, test::subscribe(id, id)));
  bench.drain(client);
  bench.hub.see(kStatic, 2, "static");
  std::size_t most = 0;
  for (int i = 0; i < 20; ++i) {
    bench.hub.see(kMap, 10 + i, std::string(50'000, 'm'));
    bench.hub.see(kRisk, 10 + i, std::string(1000, 'r'));
    most = std::max(most, bench.hub.waiting_bytes(client));
  }
  CHECK(most < 52'000);  // one map
  std::vector<std::uint64_t> maps;
  std::size_t statics = 0, told = 0;
  for (const Frame& frame : bench.drain(client)) {
    if (frame.is_text) {
      ++told;
      continue;
    }
    const auto data = bench.data(frame);
    if (data.subscription == 1) maps.push_back(data.time);
    if (data.subscription == 3) ++statics;
  }
  CHECK(maps == std::vector<std::uint64_t>{29});
  CHECK(statics == 1);
  CHECK(told == 1);
}

TEST_CASE("a client that asks and does not read the answers is closed") {
  Bench bench;
  const auto client = bench.join();
  int asked = 0;
  while (bench.hub.text(client, "{}") && asked < 1'000'000) ++asked;
  CHECK(asked > 1'000);
  CHECK(asked < 100'000);
  bench.hub.leave(client);
  CHECK_FALSE(bench.hub.text(client, "{}"));
  CHECK_FALSE(bench.hub.next(client));
  CHECK(bench.hub.waiting_bytes(client) == 0);
}

TEST_CASE("frames of any bytes are answered or done, and nothing else") {
  Bench bench;
  bench.hub.see(kMap, 1, "map");
  bench.hub.see(kRisk, 1, "risk");
  const std::vector<std::string> seeds{
      test::subscribe(1, 1),
      test::subscribe(2, 2),
      R"({"op":"unsubscribe","subscriptionIds":[1,2]})",
      test::advertise(1, "/initialpose", "geometry_msgs/PoseStamped", "json"),
      test::advertise(2, "/initialpose", "geometry_msgs/PoseWithCovarianceStamped", "cdr"),
      R"({"op":"unadvertise","channelIds":[1,2]})",
      std::string(10'000, '['),
      test::message(1, test::pose_in_json().dump()),
      test::message(2, std::string("\0\1\0\0\0\0\0\0\0\0\0\0\4\0\0\0map\0", 20))};
  std::mt19937 random(44);
  auto client = bench.join();
  for (int i = 0; i < 20'000; ++i) {
    std::string frame = seeds[random() % seeds.size()];
    for (std::uint32_t changes = random() % 4; changes > 0 && !frame.empty(); --changes) {
      const std::size_t at = random() % frame.size();
      switch (random() % 3) {
        case 0: frame[at] = static_cast<char>(random()); break;
        case 1: frame.erase(at, random() % 8); break;
        default: frame.insert(at, 1 + random() % 3, static_cast<char>(random())); break;
      }
    }
    CHECK((random() % 2 == 0 ? bench.hub.text(client, frame) : bench.hub.binary(client, frame)));
    bench.drain(client);
    if (random() % 100 == 0) {
      bench.hub.leave(client);
      client = bench.join();
    }
  }
  // It still works.
  bench.hub.leave(client);
  client = bench.join();
  CHECK(bench.hub.text(client, test::subscribe(1, 1)));
  const auto frames = bench.drain(client);
  REQUIRE(frames.size() == 1);
  CHECK(bench.data(frames[0]).message == "map");
}

}  // namespace
}  // namespace vantage::foxglove
