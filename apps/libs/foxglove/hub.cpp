#include "foxglove/hub.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "foxglove/pose_message.hpp"
#include "foxglove/status.hpp"
#include "io/ros/little_endian.hpp"
#include "io/ros/schemas.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage::foxglove {
namespace {

using Json = nlohmann::json;

// Opcode of messages of topics, from the server and from clients.
constexpr char kMessageData = 1;
// What one client may ask for; far more than there are topics.
constexpr std::size_t kMostOfAClient = 1000;

/// A number of 32 bits in an object, or an element itself.
std::optional<std::uint32_t> number(const Json& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto wide = value.get<std::uint64_t>();
  if (wide > 0xFFFFFFFFU) return std::nullopt;
  return static_cast<std::uint32_t>(wide);
}
std::optional<std::uint32_t> number(const Json& object, const char* name) {
  if (!object.is_object() || !object.contains(name)) return std::nullopt;
  return number(object[name]);
}
std::optional<std::string> text(const Json& object, const char* name) {
  if (!object.is_object() || !object.contains(name) || !object[name].is_string()) {
    return std::nullopt;
  }
  return object[name].get<std::string>();
}

}  // namespace

/// A text of a client, taken apart before the hub is locked.
struct Hub::Request {
  enum class Kind : std::uint8_t { refused, subscribe, unsubscribe, advertise, unadvertise };
  struct Item {
    std::uint32_t id = 0, channel = 0;
    std::string topic = {};
    Publication publication = {};
  };
  Kind kind = Kind::refused;
  std::string why;  // it is refused
  std::vector<Item> items;

  static Request from(std::string_view frame);

 private:
  static Request refusal(std::string why) {
    return {.kind = Kind::refused, .why = std::move(why), .items = {}};
  }
  static std::optional<Item> item(Kind kind, const Json& value);
};

std::optional<Hub::Request::Item> Hub::Request::item(Kind kind, const Json& value) {
  Item item;
  if (kind == Kind::unsubscribe || kind == Kind::unadvertise) {
    const auto id = number(value);
    if (!id) return std::nullopt;
    item.id = *id;
    return item;
  }
  const auto id = number(value, "id");
  if (!id) return std::nullopt;
  item.id = *id;
  if (kind == Kind::subscribe) {
    const auto channel = number(value, "channelId");
    if (!channel) return std::nullopt;
    item.channel = *channel;
    return item;
  }
  auto topic = foxglove::text(value, "topic"), type = foxglove::text(value, "schemaName"),
       encoding = foxglove::text(value, "encoding");
  if (!topic || !type || !encoding) return std::nullopt;
  item.topic = *std::move(topic);
  item.publication = {.type = *std::move(type), .encoding = *std::move(encoding)};
  return item;
}

Hub::Request Hub::Request::from(std::string_view frame) {
  struct Operation {
    std::string_view name;
    Kind kind;
    const char* items;
    std::string_view item;
  };
  static constexpr Operation kOperations[] = {
      {"subscribe", Kind::subscribe, "subscriptions", "{ id, channelId }"},
      {"unsubscribe", Kind::unsubscribe, "subscriptionIds", "number"},
      {"advertise", Kind::advertise, "channels", "{ id, topic, encoding, schemaName }"},
      {"unadvertise", Kind::unadvertise, "channelIds", "number"}};
  const Json json = Json::parse(frame, nullptr, false);
  if (json.is_discarded()) return refusal("a text is no JSON");
  const auto op = foxglove::text(json, "op");
  if (!op) return refusal("a text is no JSON object with a text 'op'");
  for (const Operation& operation : kOperations) {
    if (*op != operation.name) continue;
    const auto wrong = [&] {
      return refusal(fmt::format("'{}' needs an array '{}' of at most {}, each of them a {}", *op,
                                 operation.items, kMostOfAClient, operation.item));
    };
    const auto found = json.find(operation.items);
    if (found == json.end() || !found->is_array() || found->size() > kMostOfAClient) return wrong();
    Request request{.kind = operation.kind, .why = {}, .items = {}};
    for (const Json& value : *found) {
      auto one = item(operation.kind, value);
      if (!one) return wrong();
      request.items.push_back(*std::move(one));
    }
    return request;
  }
  return refusal(fmt::format("'{}' is nothing that this server does", op->substr(0, 100)));
}

Hub::Channel* Hub::channel_of(const dds::Topic& topic) {
  if (const auto found = by_topic_.find(topic.name); found != by_topic_.end()) {
    return found->second;
  }
  const auto schema = io::ros::schema_of(topic.type);
  if (!schema) return by_topic_[topic.name] = nullptr;
  Channel* const channel =
      &channels_.emplace_back(Channel{.id = static_cast<std::uint32_t>(channels_.size() + 1),
                                      .topic = topic,
                                      .type = schema->name,
                                      .schema = schema->text,
                                      .kept = {}});
  by_topic_[topic.name] = channel;
  const std::string text = announcement({channel});
  for (auto& [id, client] : clients_) tell(client, text);
  return channel;
}

std::string Hub::announcement(const std::vector<const Channel*>& channels) const {
  Json list = Json::array();
  for (const Channel* const one : channels) {
    list.push_back({{"id", one->id},
                    {"topic", one->topic.name},
                    {"encoding", kCdr},
                    {"schemaName", one->type},
                    {"schemaEncoding", "ros2msg"},
                    {"schema", one->schema}});
  }
  return json_line(Json{{"op", "advertise"}, {"channels", std::move(list)}});
}

void Hub::tell(Client& client, std::string text) {
  client.outbox.tell(std::move(text));
  if (std::exchange(client.is_idle, false)) client.wake();
}

void Hub::put(Client& client, std::uint32_t subscription, const Channel& channel, std::int64_t time,
              const Bytes& message) {
  std::string head(1, kMessageData);
  io::ros::append_little_endian(head, subscription);
  io::ros::append_little_endian(head, static_cast<std::uint64_t>(time));
  std::optional<Outbox::Latched> latched;
  if (const dds::Qos& qos = channel.topic.qos; qos.transient_local) {
    latched = Outbox::Latched{.channel = channel.id, .depth = qos.depth};
  }
  client.outbox.put({.is_text = false, .head = std::move(head), .body = message}, latched);
  if (std::exchange(client.is_idle, false)) client.wake();
}

void Hub::see(const dds::Topic& topic, std::int64_t time, std::string_view message) {
  const bool is_latched = topic.qos.transient_local;
  {
    const std::scoped_lock lock(mutex_);
    const Channel* const channel = channel_of(topic);
    if (!channel || (!is_latched && channel->subscribers == 0)) return;
  }
  const auto bytes = std::make_shared<const std::string>(message);
  Bytes forgotten;  // freed after the lock: a map is large
  const std::scoped_lock lock(mutex_);
  Channel& channel = *channel_of(topic);
  if (is_latched) {
    channel.kept.emplace_back(time, bytes);
    if (channel.kept.size() > topic.qos.depth) {
      forgotten = std::move(channel.kept.front().second);
      channel.kept.pop_front();
    }
  }
  for (auto& [id, client] : clients_) {
    const auto found = client.subscriptions.find(channel.id);
    if (found != client.subscriptions.end()) put(client, found->second, channel, time, bytes);
  }
}

Hub::ClientId Hub::join(std::function<void()> wake) {
  Json info{{"op", "serverInfo"},
            {"name", options_.name},
            {"capabilities", Json::array()},
            {"metadata", options_.metadata},
            {"sessionId", options_.session}};
  info["metadata"]["ROS_DISTRO"] = options_.distribution;
  if (!options_.initial_pose.empty()) {
    info["capabilities"].push_back("clientPublish");
    info["supportedEncodings"] = {kCdr, kJson};
  }
  const std::scoped_lock lock(mutex_);
  const auto [client, is_new] =
      clients_.try_emplace(++last_client_, Client{.outbox = Outbox(options_.most_waiting),
                                                  .wake = std::move(wake),
                                                  .subscriptions = {},
                                                  .publications = {}});
  client->second.outbox.tell(json_line(info));
  std::vector<const Channel*> all;
  for (const Channel& channel : channels_) all.push_back(&channel);
  if (!all.empty()) client->second.outbox.tell(announcement(all));
  return last_client_;
}

void Hub::leave(ClientId client) {
  decltype(clients_)::node_type gone;  // freed after the lock
  const std::scoped_lock lock(mutex_);
  gone = clients_.extract(client);
  if (!gone) return;
  for (const auto& [channel, number] : gone.mapped().subscriptions) {
    --channels_[channel - 1].subscribers;
  }
}

void Hub::subscribe(Client& client, std::uint32_t number, std::uint32_t channel) {
  const auto refuse = [&](std::string_view why) {
    tell(client, status(Level::error, fmt::format("subscription {}: {}", number, why)));
  };
  if (channel == 0 || channel > channels_.size()) {
    return refuse(fmt::format("there is no channel {}", channel));
  }
  for (const auto& [other, taken] : client.subscriptions) {
    if (taken == number) return refuse("this number is taken by another subscription");
  }
  if (!client.subscriptions.try_emplace(channel, number).second) {
    return refuse(fmt::format("the channel {} is subscribed already", channel));
  }
  Channel& wanted = channels_[channel - 1];
  ++wanted.subscribers;
  for (const auto& [time, message] : wanted.kept) put(client, number, wanted, time, message);
}

void Hub::unsubscribe(Client& client, std::uint32_t number) {
  for (const auto& [channel, taken] : client.subscriptions) {
    if (taken != number) continue;
    --channels_[channel - 1].subscribers;
    client.subscriptions.erase(channel);
    return;
  }
  tell(client, status(Level::warning, fmt::format("there is no subscription {}", number)));
}

/// Panels announce all that they might publish, and take it back. Only what they do publish is
/// complained about.
void Hub::begin_publication(Client& client, std::uint32_t number, const std::string& topic,
                            Publication publication) {
  if (options_.initial_pose.empty() || topic != options_.initial_pose) return;
  if (client.publications.size() >= kMostOfAClient ||
      !client.publications.try_emplace(number, std::move(publication)).second) {
    tell(client, status(Level::error, fmt::format("publication {}: this number is taken, or there "
                                                  "are too many",
                                                  number)));
  }
}

void Hub::act(Client& client, const Request& request) {
  using Kind = Request::Kind;
  if (request.kind == Kind::refused) tell(client, status(Level::error, request.why));
  for (const Request::Item& item : request.items) {
    switch (request.kind) {
      case Kind::refused: break;
      case Kind::subscribe: subscribe(client, item.id, item.channel); break;
      case Kind::unsubscribe: unsubscribe(client, item.id); break;
      case Kind::advertise: begin_publication(client, item.id, item.topic, item.publication); break;
      case Kind::unadvertise: client.publications.erase(item.id); break;
    }
  }
}

bool Hub::text(ClientId id, std::string_view frame) {
  const Request request = Request::from(frame);
  const std::scoped_lock lock(mutex_);
  const auto client = clients_.find(id);
  if (client == clients_.end()) return false;
  act(client->second, request);
  return !client->second.outbox.is_deaf();
}

bool Hub::binary(ClientId id, std::string_view frame) {
  constexpr std::size_t kHead = 5;
  std::optional<Publication> publication;
  std::string complaint;
  if (frame.size() < kHead || frame[0] != kMessageData) {
    complaint =
        "a binary frame is no message of a channel, which has the opcode 1 and at least 5 "
        "bytes";
  } else {
    std::uint32_t number = 0;
    for (std::size_t i = 4; i > 0; --i) number = number << 8U | static_cast<std::uint8_t>(frame[i]);
    const std::scoped_lock lock(mutex_);
    const auto client = clients_.find(id);
    if (client == clients_.end()) return false;
    const auto found = client->second.publications.find(number);
    if (found != client->second.publications.end()) {
      publication = found->second;
    } else {
      complaint =
          options_.initial_pose.empty()
              ? "clients cannot publish here"
              : fmt::format("clients can publish poses on '{}' only", options_.initial_pose);
    }
  }
  if (publication) {
    auto pose = given_pose(publication->type, publication->encoding, frame.substr(kHead));
    if (pose) {
      sink_(*std::move(pose));
      return true;
    }
    complaint = "a pose cannot be used: " + pose.error().message;
  }
  const std::scoped_lock lock(mutex_);
  const auto client = clients_.find(id);
  if (client == clients_.end()) return false;
  tell(client->second, status(Level::error, complaint));
  return !client->second.outbox.is_deaf();
}

std::optional<Frame> Hub::next(ClientId id) {
  const std::scoped_lock lock(mutex_);
  const auto client = clients_.find(id);
  if (client == clients_.end()) return std::nullopt;
  auto frame = client->second.outbox.next();
  client->second.is_idle = !frame;
  return frame;
}

std::size_t Hub::waiting_bytes(ClientId id) const {
  const std::scoped_lock lock(mutex_);
  const auto client = clients_.find(id);
  return client == clients_.end() ? 0 : client->second.outbox.waiting_bytes();
}

}  // namespace vantage::foxglove
