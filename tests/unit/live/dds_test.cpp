#include "dds/participant.hpp"

#include <doctest/doctest.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "dds/type_hash.hpp"
#include "io/ros/message_writers.hpp"
#include "io/ros/schemas.hpp"
#include "support/ros_client.hpp"

namespace vantage::dds {
namespace {

std::string hash_of(const char* type) {
  return type_hash(io::ros::schema_of(type).value()).value();
}

TEST_CASE("type hashes are those of ROS 2 (REP-2011)") {
  // As recorded from ROS 2 Iron and later.
  CHECK(hash_of("sensor_msgs/PointCloud2") ==
        "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5");
  CHECK(hash_of("rmw_dds_common/ParticipantEntitiesInfo") ==
        "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e");
  CHECK(hash_of("tf2_msgs/TFMessage").starts_with("RIHS01_e369d0f0"));
  CHECK(hash_of("sensor_msgs/Imu").starts_with("RIHS01_7d9a00ff"));
  CHECK(hash_of("sensor_msgs/NavSatFix").starts_with("RIHS01_62223ab3"));
  CHECK(hash_of("rosgraph_msgs/Clock").starts_with("RIHS01_692f7a66"));
  // A service's hash is that of its request, response and event together.
  CHECK(type_hash(io::ros::service_schema_of("std_srvs/SetBool").value()) ==
        "RIHS01_abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a");
}

TEST_CASE("a definition that is none has no hash") {
  CHECK_FALSE(type_hash({.name = "a/msg/B", .text = "float64\n"}));
  CHECK_FALSE(type_hash({.name = "a/msg/B", .text = "float64[ x\n"}));
  CHECK_FALSE(type_hash({.name = "a/msg/B", .text = "float64[x] y\n"}));
  CHECK_FALSE(type_hash({.name = "a/msg/B", .text = "float64[<=] y\n"}));
  CHECK_FALSE(io::ros::service_schema_of("std_srvs/Trigger"));
  CHECK_FALSE(io::ros::service_schema_of(""));
}

ParticipantOptions options_of_test() {
  return {.domain = 100 + static_cast<std::uint32_t>(getpid()) % 100, .node = "test"};
}

TEST_CASE("messages pass between participants as they are") {
  auto from = Participant::open(options_of_test()), to = Participant::open(options_of_test());
  REQUIRE(from);
  REQUIRE(to);
  const Topic topic{.name = "/text", .type = "std_msgs/String", .qos = {.transient_local = true}};
  std::mutex mutex;
  std::condition_variable changed;
  std::string received;
  const std::string sent = io::ros::write_string(std::string(3'000'000, 'x')).value();
  auto writer = from->advertise(topic);
  REQUIRE(writer);
  CHECK(from->announce());
  REQUIRE(writer->write(sent));
  // The reader comes later than the message.
  REQUIRE(to->subscribe(topic, [&](std::string&& message) {
    const std::scoped_lock lock(mutex);
    received = std::move(message);
    changed.notify_one();
  }));
  std::unique_lock lock(mutex);
  changed.wait(lock, [&] { return !received.empty(); });
  CHECK(received == sent);
  CHECK(writer->readers() == 1);
  CHECK(to->writers_of("/text") == 1);
  CHECK(to->writers_of("/other") == 0);
}

TEST_CASE("endpoints whose quality of service or type does not fit are told on both sides") {
  std::mutex mutex;
  std::condition_variable changed;
  std::set<std::string> told;
  const auto options = [&](const std::string& who) {
    ParticipantOptions own = options_of_test();
    own.misfit = [&, who](const Misfit& found) {
      const std::scoped_lock lock(mutex);
      told.insert(who + (found.is_read ? " reads " : " writes ") + found.topic + ": " +
                  (found.policy.empty() ? found.other_type : found.policy));
      changed.notify_all();
    };
    return own;
  };
  auto from = Participant::open(options("from")), to = Participant::open(options("to"));
  REQUIRE(from);
  REQUIRE(to);
  const auto connect = [&](const char* name, const Qos& offered, const Qos& requested) {
    CHECK(from->advertise({.name = name, .type = "std_msgs/String", .qos = offered}));
    CHECK(to->subscribe({.name = name, .type = "std_msgs/String", .qos = requested},
                        [](std::string&&) {}));
  };
  connect("/fits", {.reliable = true, .transient_local = true}, {.reliable = false});
  connect("/lossy", {.reliable = false}, {.reliable = true});
  connect("/late", {.transient_local = false}, {.transient_local = true});
  connect("/both", {.reliable = false}, {.reliable = true, .transient_local = true});
  CHECK(from->advertise({.name = "/type", .type = "std_msgs/String"}));
  CHECK(to->subscribe({.name = "/type", .type = "sensor_msgs/Imu"}, [](std::string&&) {}));
  std::set<std::string> expected;
  for (const char* one :
       {"/lossy: RELIABILITY", "/late: DURABILITY", "/both: RELIABILITY", "/both: DURABILITY"}) {
    expected.insert(std::string("from writes ") + one);
    expected.insert(std::string("to reads ") + one);
  }
  expected.insert("from writes /type: sensor_msgs/Imu");
  expected.insert("to reads /type: std_msgs/String");
  {
    std::unique_lock lock(mutex);
    changed.wait_for(lock, std::chrono::seconds(20),
                     [&] { return told.size() >= expected.size(); });
    CHECK(told == expected);
  }
  CHECK(to->misfits().size() == 5);
  from = fail(ErrorCode::io_failure, "ends");
  const auto last = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!to->misfits().empty() && std::chrono::steady_clock::now() < last) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  CHECK(to->misfits().empty());
}

TEST_CASE("clients of ROS 2 get the answers to their own requests") {
  const ParticipantOptions options = options_of_test();
  auto server = Participant::open(options);
  REQUIRE(server);
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::pair<RequestId, std::string>> requests;
  auto replier = server->serve({.name = "/a/trigger", .type = "std_srvs/SetBool"},
                               [&](const RequestId& id, std::string&& request) {
                                 const std::scoped_lock lock(mutex);
                                 requests.emplace_back(id, std::move(request));
                                 changed.notify_one();
                               });
  REQUIRE(replier);
  CHECK(server->announce());
  test::RosClient one(options.domain, "/a/trigger", "std_srvs::srv::dds_::SetBool_");
  test::RosClient two(options.domain, "/a/trigger", "std_srvs::srv::dds_::SetBool_");
  one.wait_for_server();
  two.wait_for_server();
  const std::string yes{0, 1, 0, 0, 1}, no{0, 1, 0, 0, 0};
  const auto first = one.send(yes), second = one.send(no), third = two.send(no);
  {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return requests.size() == 3; });
  }
  // In the opposite order, each with a text of its own.
  for (std::size_t i = requests.size(); i-- > 0;) {
    const auto& [id, request] = requests[i];
    CHECK(replier->reply(
        id, io::ros::write_string(std::string(request) + std::to_string(id.number)).value(),
        std::chrono::steady_clock::now() + std::chrono::seconds(20)));
  }
  const auto answer = [](const std::string& request, std::int64_t number) {
    return io::ros::write_string(request + std::to_string(number)).value();
  };
  CHECK(one.answer_to(first) == answer(yes, first));
  CHECK(one.answer_to(second) == answer(no, second));
  CHECK(two.answer_to(third) == answer(no, third));

  RequestId gone = requests.front().first;
  gone.client[0] ^= 1U;
  const auto lost = replier->reply(gone, yes, std::chrono::steady_clock::now());
  REQUIRE_FALSE(lost);
  CHECK(lost.error().message == "the client of /a/trigger went away before its answer");
}

TEST_CASE("names that are no topics and types that are not known are refused") {
  auto participant = Participant::open(options_of_test());
  REQUIRE(participant);
  for (const char* name : {"", "/", "points", "/points/", "/a//b", "/a b", "/a-b"}) {
    CAPTURE(name);
    const auto made = participant->advertise({.name = name, .type = "std_msgs/String"});
    REQUIRE_FALSE(made);
    CHECK(made.error().message.find("is not the name of a topic or service") != std::string::npos);
  }
  CHECK_FALSE(participant->serve({.name = "a", .type = "std_srvs/SetBool"}, {}));
  CHECK_FALSE(participant->serve({.name = "/a", .type = "std_srvs/Own"}, {}));
  const auto made = participant->advertise({.name = "/a", .type = "my_msgs/Own"});
  REQUIRE_FALSE(made);
  CHECK(made.error().message == "no definition of 'my_msgs/Own' is known");
}

}  // namespace
}  // namespace vantage::dds
