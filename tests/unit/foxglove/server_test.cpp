#include "foxglove/server.hpp"

#include <doctest/doctest.h>

#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client.hpp"
#include "protocol.hpp"

namespace vantage::foxglove {
namespace {

using test::Client;
using test::data_of;
using test::Json;
using test::kMap;
using test::kRisk;

/// A server, what it said and the poses that it got.
struct Served {
  explicit Served(std::size_t clients = 4, std::size_t most_waiting = 1U << 20U) {
    auto opened = Server::open(
        {.port = 0,
         .most_clients = clients,
         .hub = {.initial_pose = "/initialpose", .most_waiting = most_waiting}},
        [this](std::string&& pose) {
          const std::scoped_lock lock(mutex);
          poses.push_back(std::move(pose));
        },
        [this](const std::string& text) {
          const std::scoped_lock lock(mutex);
          said.push_back(text);
        });
    REQUIRE(opened);
    server = *std::move(opened);
  }
  Client client(const std::string& subprotocols = "foxglove.sdk.v1") {
    Client one(server->port());
    REQUIRE(one.shake_hands(subprotocols) == 101);
    return one;
  }

  std::mutex mutex;
  std::vector<std::string> poses, said;
  std::unique_ptr<Server> server;
};

/// The next text of this kind.
Json next_text(Client& client, const std::string& op) {
  while (const auto frame = client.read()) {
    if (!frame->is_text) continue;
    Json json = Json::parse(frame->bytes);
    if (json["op"] == op) return json;
  }
  FAIL("no text '" << op << "'");
  return {};
}

test::Data next_data(Client& client) {
  while (const auto frame = client.read()) {
    if (!frame->is_text) return data_of(frame->bytes);
  }
  FAIL("no message");
  return {};
}

TEST_CASE("server: of the subprotocols that a client offers, the first that is known is chosen") {
  Served served;
  const std::pair<std::string, std::string> offers[] = {
      {"foxglove.websocket.v1", "foxglove.websocket.v1"},
      {"foxglove.sdk.v1", "foxglove.sdk.v1"},
      {"foxglove.sdk.v1, foxglove.websocket.v1", "foxglove.sdk.v1"},
      {"foxglove.websocket.v1,foxglove.sdk.v1", "foxglove.websocket.v1"},
      {"mqtt, foxglove.websocket.v1", "foxglove.websocket.v1"}};
  for (const auto& [offer, chosen] : offers) {
    CAPTURE(offer);
    Client client(served.server->port());
    CHECK(client.shake_hands(offer) == 101);
    CHECK(client.subprotocol() == chosen);
    CHECK(next_text(client, "serverInfo")["name"] == "vantage");
  }
}

/// The answer to a request over HTTP.
std::string answer_to(const Served& served, const std::string& request) {
  Client client(served.server->port());
  CHECK(client.raw(request));
  return client.read_raw();
}

/// The length that the header tells, and that of what follows it.
std::pair<std::size_t, std::size_t> lengths_of(const std::string& answer) {
  const std::string name = "Content-Length: ", end = "\r\n\r\n";
  REQUIRE(answer.find(name) < answer.find(end));
  return {std::stoul(answer.substr(answer.find(name) + name.size())),
          answer.size() - answer.find(end) - end.size()};
}

TEST_CASE("server: other subprotocols are refused with a reason") {
  Served served;
  for (const char* const offer : {"", "mqtt", "foxglove.websocket.v2", "Foxglove.sdk.v1"}) {
    CAPTURE(offer);
    Client client(served.server->port());
    CHECK(client.shake_hands(offer) == 400);
  }
}

TEST_CASE("server: a browser gets the page, and its connection ends") {
  Served served;
  const std::string page =
      answer_to(served, "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: keep-alive\r\n\r\n");
  CHECK(page.starts_with("HTTP/1.1 200 OK\r\n"));
  CHECK(page.find("\r\nContent-Security-Policy: default-src 'none'; ") != std::string::npos);
  CHECK(page.find("\r\nConnection: close\r\n") != std::string::npos);
  CHECK(page.ends_with("</html>\n"));
  const auto [told, sent] = lengths_of(page);
  CHECK(told == sent);
  const std::string head = answer_to(served, "HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK(head.starts_with("HTTP/1.1 200 OK\r\n"));
  CHECK(lengths_of(head) == std::pair(told, std::size_t{0}));
}

TEST_CASE("server: other targets and methods get an answer, and no page") {
  Served served;
  CHECK(answer_to(served, "GET /no HTTP/1.1\r\nHost: a\r\n\r\n").starts_with("HTTP/1.1 404 "));
  CHECK(answer_to(served, "HEAD /no HTTP/1.1\r\nHost: a\r\n\r\n").ends_with("\r\n\r\n"));
  const std::string post = "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: ";
  for (const std::size_t size : {0U, 5U, 300'000U}) {  // the last is more than sockets hold
    CAPTURE(size);
    const std::string answer =
        answer_to(served, post + std::to_string(size) + "\r\n\r\n" + std::string(size, 'x'));
    CHECK(answer.starts_with("HTTP/1.1 405 "));
    CHECK(answer.find("\r\nAllow: GET, HEAD\r\n") != std::string::npos);
  }
  CHECK(answer_to(served, "BREW / HTTP/1.1\r\nHost: a\r\n\r\n").starts_with("HTTP/1.1 405 "));
  CHECK(answer_to(served, "no request\r\n\r\n").empty());
}

TEST_CASE("server: a header that is too long gets no answer") {
  Served served;
  const std::string begin = "GET / HTTP/1.1\r\nHost: a\r\nX: ", end = "\r\n\r\n";
  CHECK(answer_to(served, begin + std::string(7000, 'x') + end).starts_with("HTTP/1.1 200 "));
  Client client(served.server->port());
  (void)client.raw(begin + std::string(9000, 'x') + end);
  CHECK(client.read_raw().empty());
}

TEST_CASE("server: requests of others do not take the place of clients") {
  Served served(1);
  Client silent(served.server->port()), slow(served.server->port());
  CHECK(slow.raw("GET / HT"));
  Client client = served.client();
  // Nor does a client take that of the page.
  CHECK(answer_to(served, "GET / HTTP/1.1\r\nHost: a\r\n\r\n").starts_with("HTTP/1.1 200 "));
  Client second(served.server->port());
  CHECK(second.shake_hands("foxglove.sdk.v1") == 503);
  CHECK(slow.raw("TP/1.1\r\nHost: a\r\n\r\n"));
  CHECK(slow.read_raw().starts_with("HTTP/1.1 200 "));
  client.text("{}");
  CHECK(next_text(client, "status")["level"] == 2);
}

TEST_CASE("server: a client gets what it subscribes to, and the map that was there before") {
  Served served;
  served.server->see(kMap, 7, "map");
  Client client = served.client();
  const Json channels = next_text(client, "advertise");
  CHECK(channels["channels"][0]["topic"] == "/map");
  client.text(test::subscribe(5, 1));
  const auto data = next_data(client);
  CHECK(data.subscription == 5);
  CHECK(data.time == 7);
  CHECK(data.message == "map");
  served.server->see(kRisk, 8, "before");
  CHECK(next_text(client, "advertise")["channels"][0]["topic"] == "/risk");
  client.text(test::subscribe(6, 2));
  client.text("{}");
  (void)next_text(client, "status");  // the subscription is taken in
  served.server->see(kRisk, 9, "risk");
  CHECK(next_data(client).message == "risk");
}

TEST_CASE("server: a pose that a client publishes arrives") {
  Served served;
  Client client = served.client();
  client.text(test::advertise(3, "/initialpose", "geometry_msgs/PoseStamped", "json"));
  client.binary(test::message(3, test::pose_in_json().dump()));
  client.text("{}");
  (void)next_text(client, "status");  // the pose is taken in
  const std::scoped_lock lock(served.mutex);
  CHECK(served.poses.size() == 1);
}

TEST_CASE("server: more clients than allowed are refused, until one goes") {
  Served served(2);
  {
    Client one = served.client(), two = served.client();
    Client three(served.server->port());
    CHECK(three.shake_hands("foxglove.sdk.v1") == 503);
  }
  // The server notices in its own time that they are gone.
  int status = 503;
  while (status == 503) {
    Client next(served.server->port());
    status = next.shake_hands("foxglove.sdk.v1");
  }
  CHECK(status == 101);
}

TEST_CASE("server: a port that is taken and an address that is none are errors") {
  Served served;
  const auto nothing = [](auto&&) {};
  const auto taken = Server::open({.port = served.server->port()}, nothing, nothing);
  REQUIRE_FALSE(taken);
  CHECK(taken.error().code == ErrorCode::io_failure);
  CHECK(taken.error().message.find("port " + std::to_string(served.server->port())) !=
        std::string::npos);
  CHECK(taken.error().message.find("choose another port") != std::string::npos);
  const auto wrong = Server::open({.address = "robot", .port = 0}, nothing, nothing);
  REQUIRE_FALSE(wrong);
  CHECK(wrong.error().code == ErrorCode::invalid_config);
  // Not an address of this machine (RFC 5737).
  const auto foreign = Server::open({.address = "192.0.2.1", .port = 0}, nothing, nothing);
  REQUIRE_FALSE(foreign);
  CHECK(foreign.error().code == ErrorCode::io_failure);
}

TEST_CASE("server: frames against the rules close their client only") {
  Served served;
  Client good = served.client();
  Client large = served.client();
  large.text(std::string(2U << 20U, ' '));
  while (large.read()) continue;
  Client no_utf8 = served.client();
  no_utf8.text("\xff\xfe");
  while (no_utf8.read()) continue;
  CHECK(no_utf8.close_code() == 1007);
  Client no_mask = served.client();
  CHECK(no_mask.raw(std::string("\x81\x02{}", 4)));
  while (no_mask.read()) continue;
  CHECK(no_mask.close_code() == 1002);
  // One that announces 2^62 bytes.
  Client huge = served.client();
  CHECK(huge.raw(std::string("\x82\xff\x40\0\0\0\0\0\0\0\1\2\3\4", 14)));
  while (huge.read()) continue;
  CHECK(huge.close_code() == 1009);
  good.text("{}");
  CHECK(next_text(good, "status")["level"] == 2);
}

TEST_CASE("server: bytes of any kind at the port do no harm") {
  Served served;
  std::mt19937 random(45);
  for (int i = 0; i < 300; ++i) {
    std::string bytes(random() % 400, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    Client client(served.server->port());
    if (i % 3 == 0) {
      (void)client.raw("GET / HTTP/1.1\r\n" + bytes);
    } else if (i % 3 == 1) {
      (void)client.raw(bytes);
    } else if (client.shake_hands("foxglove.sdk.v1") == 101) {
      (void)client.raw(bytes);
    }
  }
  // It still serves, once it has noticed that those are gone.
  int status = 0;
  for (int tries = 0; status != 101 && tries < 10'000; ++tries) {
    Client next(served.server->port());
    status = next.shake_hands("foxglove.sdk.v1");
  }
  CHECK(status == 101);
}

TEST_CASE("server: who shows it something does not wait for a client that does not read") {
  constexpr std::size_t kLimit = 4U << 20U, kMessage = 1U << 20U, kMessages = 200;
  Served served(4, kLimit);
  Client slow = served.client();
  served.server->see(kRisk, 0, "");
  (void)next_text(slow, "advertise");
  slow.text(test::subscribe(1, 1));
  slow.text("{}");
  (void)next_text(slow, "status");
  const std::string message(kMessage, 'x');
  for (std::size_t i = 1; i <= kMessages; ++i) {
    served.server->see(kRisk, static_cast<std::int64_t>(i), message);
  }
  // All are shown before the first is read: sockets and the limit hold a part of them only.
  std::size_t got = 0, told = 0;
  std::uint64_t last = 0;
  while (last < kMessages) {
    const auto frame = slow.read();
    REQUIRE(frame);
    if (frame->is_text) {
      CHECK(Json::parse(frame->bytes)["id"] == "left_out");
      ++told;
      continue;
    }
    const auto data = data_of(frame->bytes);
    CHECK(data.time > last);
    CHECK(data.message.size() == kMessage);
    last = data.time;
    ++got;
  }
  CHECK(got < kMessages);
  // Once, and again if it had caught up for a moment in between (hub_test.cpp tests the rule).
  CHECK(told >= 1);
  CHECK(told < kMessages - got);
}

TEST_CASE("server: at its end, clients are told that it goes away") {
  Served served;
  Client reads = served.client(), does_not = served.client();
  Client asks_nothing(served.server->port());
  for (Client* const one : {&reads, &does_not}) (void)next_text(*one, "serverInfo");
  served.server.reset();
  while (reads.read()) continue;
  CHECK(reads.close_code() == 1001);
  const std::scoped_lock lock(served.mutex);
  CHECK(served.said.size() >= 2);
}

}  // namespace
}  // namespace vantage::foxglove
