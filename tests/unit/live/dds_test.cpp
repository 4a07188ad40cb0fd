#include "dds/participant.hpp"

#include <doctest/doctest.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>

#include "dds/type_hash.hpp"
#include "io/ros/message_writers.hpp"
#include "io/ros/schemas.hpp"

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
}

TEST_CASE("a definition that is none has no hash") {
  CHECK_FALSE(type_hash({.name = "a/msg/B", .text = "float64\n"}));
  CHECK_FALSE(type_hash({.name = "a/msg/B", .text = "float64[ x\n"}));
  CHECK_FALSE(type_hash({.name = "a/msg/B", .text = "float64[x] y\n"}));
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

TEST_CASE("names that are no topics and types that are not known are refused") {
  auto participant = Participant::open(options_of_test());
  REQUIRE(participant);
  for (const char* name : {"", "/", "points", "/points/", "/a//b", "/a b", "/a-b"}) {
    CAPTURE(name);
    const auto made = participant->advertise({.name = name, .type = "std_msgs/String"});
    REQUIRE_FALSE(made);
    CHECK(made.error().message.find("is not the name of a topic") != std::string::npos);
  }
  const auto made = participant->advertise({.name = "/a", .type = "my_msgs/Own"});
  REQUIRE_FALSE(made);
  CHECK(made.error().message == "no definition of 'my_msgs/Own' is known");
}

}  // namespace
}  // namespace vantage::dds
