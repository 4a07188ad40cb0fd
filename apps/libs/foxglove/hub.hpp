#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dds/participant.hpp"
#include "foxglove/outbox.hpp"
#include "vantage/result.hpp"

namespace vantage::foxglove {

/// Names of the protocol in the handshake. Both mean the same; newer clients know only the second.
inline constexpr std::string_view kSubprotocols[] = {"foxglove.websocket.v1", "foxglove.sdk.v1"};

struct HubOptions {
  std::string name = "vantage";        ///< as clients show it
  std::string distribution = "jazzy";  ///< clients encode for this release of ROS 2
  std::string session = {};            ///< differs after a restart, so that clients begin anew
  std::string initial_pose = {};       ///< topic on which clients may publish a pose; "" for none
  std::map<std::string, std::string> metadata = {};  ///< what else the server tells of itself
  std::size_t most_waiting = 64U << 20U;             ///< for each client [bytes]
};

/// Takes a pose that a client published: CDR of geometry_msgs/PoseWithCovarianceStamped. Called in
/// the thread of the call of `Hub::binary`.
using PoseSink = std::function<void(std::string&& message)>;

/// The protocol of Foxglove without the network (github.com/foxglove/ws-protocol, docs/spec.md): it
/// takes the messages of topics and the frames of clients, and says what each client gets. A
/// channel is announced at the first message of its topic. Functions may be called from any thread.
class Hub {
 public:
  using ClientId = std::uint64_t;

  Hub(HubOptions options, PoseSink sink) : options_(std::move(options)), sink_(std::move(sink)) {}

  /// Gives a message to those who want it; see live::Observer::see. A topic whose type is not known
  /// (see io::ros::schema_of) is not shown.
  void see(const dds::Topic& topic, std::int64_t time, std::string_view message);

  /// A client comes; it is told what there is.
  /// @param wake  called when there is something to send after `next` returned nothing; must return
  ///              at once, and call nothing of the hub
  [[nodiscard]] ClientId join(std::function<void()> wake);
  void leave(ClientId client);
  /// Takes a frame of a client. What is wrong with it is told to the client.
  /// @return false if the client is to be closed: it does not read what it is told
  [[nodiscard]] bool text(ClientId client, std::string_view frame);
  [[nodiscard]] bool binary(ClientId client, std::string_view frame);
  /// What a client is sent next; nothing if nothing waits.
  [[nodiscard]] std::optional<Frame> next(ClientId client);

  /// What waits for a client [bytes]; 0 for one that left.
  [[nodiscard]] std::size_t waiting_bytes(ClientId client) const;

 private:
  using Bytes = std::shared_ptr<const std::string>;
  struct Channel {
    std::uint32_t id;
    dds::Topic topic;
    std::string type, schema;                         // as ROS 2 spells them
    std::deque<std::pair<std::int64_t, Bytes>> kept;  // of a latched topic, with their times
    std::size_t subscribers = 0;
  };
  /// A channel that a client publishes on.
  struct Publication {
    std::string type, encoding;
  };
  struct Client {
    Outbox outbox;
    std::function<void()> wake;
    bool is_idle = false;                                  // `next` returned nothing
    std::map<std::uint32_t, std::uint32_t> subscriptions;  // channel -> the client's number
    std::map<std::uint32_t, Publication> publications;     // by the client's number
  };
  struct Request;

  // All of these are called with the mutex held.
  [[nodiscard]] Channel* channel_of(const dds::Topic& topic);
  [[nodiscard]] std::string announcement(const std::vector<const Channel*>& channels) const;
  void tell(Client& client, std::string text);
  void put(Client& client, std::uint32_t subscription, const Channel& channel, std::int64_t time,
           const Bytes& message);
  void subscribe(Client& client, std::uint32_t number, std::uint32_t channel);
  void unsubscribe(Client& client, std::uint32_t number);
  void begin_publication(Client& client, std::uint32_t number, const std::string& topic,
                         Publication publication);
  void act(Client& client, const Request& request);

  const HubOptions options_;
  const PoseSink sink_;
  mutable std::mutex mutex_;
  std::deque<Channel> channels_;                           // the id is the position and 1
  std::map<std::string, Channel*, std::less<>> by_topic_;  // nullptr: of an unknown type
  std::map<ClientId, Client> clients_;
  ClientId last_client_ = 0;
};

}  // namespace vantage::foxglove
