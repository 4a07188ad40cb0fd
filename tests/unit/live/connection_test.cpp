#include "live/connection.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <set>
#include <string>
#include <vector>

namespace vantage::live {
namespace {

using std::chrono::milliseconds;

/// A node whose networks come and go.
struct Node {
  std::set<std::string> networks;
  int connected = 0, disconnected = 0, failures = 0;  // failures: of those to come
  std::vector<std::string> told;
  Notices notices{[this](const std::string& text) { told.push_back(text); }};
  Connection connection{[this]() -> Result<void> {
                          if (failures > 0) {
                            --failures;
                            return fail(ErrorCode::io_failure, "no room for a socket");
                          }
                          ++connected;
                          return {};
                        },
                        [this] { ++disconnected; }, notices, [this] { return networks; }};
  std::chrono::steady_clock::time_point time;

  void follow(int seconds) {
    for (int i = 0; i < 10 * seconds; ++i) connection.follow(time += milliseconds(100));
  }
};

TEST_CASE("a node that began without a network connects again once one is up") {
  Node node;
  REQUIRE(node.connection.open());
  REQUIRE(node.told.size() == 1);
  CHECK(node.told[0].find("no network is up") == 0);
  node.follow(5);
  CHECK(node.connected == 1);
  node.networks = {"eth0 10.0.0.2"};
  node.follow(5);
  CHECK(node.connected == 2);
  CHECK(node.disconnected == 1);
  CHECK(node.told.size() == 2);
  CHECK(node.told[1] == "the network eth0 10.0.0.2 came up: connects again");

  // It reaches nodes now, which a second one must not interrupt.
  node.networks.insert("wlan0 10.0.1.2");
  node.follow(5);
  CHECK(node.connected == 2);
  CHECK(node.told.size() == 3);
  CHECK(node.told[2].find("wlan0 10.0.1.2 came up: nodes in it are found after a new start") !=
        std::string::npos);
}

TEST_CASE("a node that cannot connect again says so, and tries again") {
  Node node;
  REQUIRE(node.connection.open());
  node.networks = {"eth0 10.0.0.2"};
  node.failures = 3;
  node.follow(3);
  CHECK(node.connected == 1);
  REQUIRE(node.connection.trouble());
  CHECK(node.connection.trouble()->find("no room for a socket") != std::string::npos);
  CHECK(node.notices.count_of("connections_failed") == 3);
  node.follow(1);
  CHECK(node.connected == 2);
  CHECK_FALSE(node.connection.trouble());
  REQUIRE(node.told.size() == 4);
  CHECK(node.told[2].find("cannot connect again, which is tried every second") == 0);
  CHECK(node.told[3] == "connected again");
  node.follow(5);
  CHECK(node.connected == 2);
}

TEST_CASE("a network that goes while a node tries to connect is waited for again") {
  Node node;
  REQUIRE(node.connection.open());
  node.networks = {"eth0 10.0.0.2"};
  node.failures = 1;
  node.follow(1);
  node.networks.clear();
  node.follow(1);
  CHECK(node.connected == 2);  // alone
  node.networks = {"eth0 10.0.0.2"};
  node.follow(1);
  CHECK(node.connected == 3);
}

TEST_CASE("a node that cannot connect at the start is an error") {
  Node node;
  node.failures = 1;
  const auto opened = node.connection.open();
  REQUIRE_FALSE(opened);
  CHECK(opened.error().message == "no room for a socket");
}

TEST_CASE("what does not fit is said in the words of ROS 2") {
  const dds::Misfit lossy{.topic = "/points",
                          .is_read = true,
                          .policy = "RELIABILITY",
                          .own_type = {},
                          .other_type = {}};
  CHECK(text_of(lossy) ==
        "a publisher of /points offers incompatible QoS (RELIABILITY): none of its messages is "
        "received");
  const dds::Misfit livox{.topic = "/points",
                          .is_read = true,
                          .policy = {},
                          .own_type = "sensor_msgs/PointCloud2",
                          .other_type = "livox_ros_driver2/CustomMsg"};
  CHECK(text_of(livox) ==
        "a publisher of /points sends livox_ros_driver2/CustomMsg, expected "
        "sensor_msgs/PointCloud2: none of its messages is received");
  dds::Misfit listener = livox;
  listener.is_read = false;
  CHECK(text_of(listener) ==
        "a subscriber of /points expects livox_ros_driver2/CustomMsg, and sensor_msgs/PointCloud2 "
        "is sent: no message is sent to it");
  CHECK(obstacles_of({lossy, listener, livox}) ==
        std::vector<std::string>{text_of(lossy), text_of(livox)});
}

}  // namespace
}  // namespace vantage::live
