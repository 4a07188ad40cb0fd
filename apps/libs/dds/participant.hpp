#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dds/endpoints.hpp"
#include "vantage/result.hpp"

namespace vantage::dds {

/// The quality of service of a topic, in the words of ROS 2.
struct Qos {
  bool reliable = true;          ///< otherwise best effort
  bool transient_local = false;  ///< the last messages are kept for readers that come later
  std::uint32_t depth = 1;       ///< messages that are kept
};

/// A topic of ROS 2.
struct Topic {
  std::string name;  ///< "/points"
  std::string type;  ///< "sensor_msgs/PointCloud2"
  Qos qos = {};
};

/// The releases of ROS 2 differ in what they expect of discovery.
enum class Release : std::uint8_t {
  humble,        ///< Gid of 24 bytes, no hashes of types
  iron_or_later  ///< Gid of 16 bytes, hashes of types
};

struct ParticipantOptions {
  std::uint32_t domain = 0;      ///< ROS_DOMAIN_ID
  std::string node = "vantage";  ///< as `ros2 node list` shows it
  Release release = Release::iron_or_later;
  std::uint32_t receive_buffer = 8U << 20U;  ///< of sockets [bytes]
  std::uint32_t shared_memory = 32U << 20U;  ///< for readers on the same machine [bytes]
  MisfitSink misfit = {};                    ///< receives each misfit; may be empty
};

/// Takes a message of a topic: CDR with its header. Called from threads of DDS, for one message of
/// a topic at a time.
using MessageSink = std::function<void(std::string&& message)>;

/// A service of ROS 2.
struct Service {
  std::string name;  ///< "/localization/trigger"
  std::string type;  ///< "std_srvs/SetBool"
};

/// Which request of which client. To be given back with the answer.
struct RequestId {
  std::array<std::uint8_t, 16> client{};  ///< Guid of the client's reader of answers
  std::int64_t number = 0;
};

/// Takes a request to a service: CDR with its header. Called from threads of DDS, for one request
/// of a service at a time.
using RequestSink = std::function<void(const RequestId& id, std::string&& request)>;

/// One node of ROS 2 as others see it: its topics, and that it exists. It speaks DDS through Fast
/// DDS; no ROS is needed. Messages pass as they are encoded (see io/ros/message_writers.hpp).
/// It is in the networks that are up when it is made (see `networks`), and on this computer. Fast
/// DDS can be told to look for networks again, but the addresses that its endpoints tell others
/// stay those of the beginning.
class Participant {
 public:
  /// A topic that is written to. Ends with its participant.
  class Writer {
   public:
    /// Errors: `io_failure` if the message could not be handed over within DDS' time.
    [[nodiscard]] Result<void> write(std::string_view message);
    /// The readers that were found, of any process.
    [[nodiscard]] std::size_t readers() const;

   private:
    friend class Participant;
    struct State;
    explicit Writer(std::shared_ptr<State> state) : state_(std::move(state)) {}
    std::shared_ptr<State> state_;
  };

  /// Answers the requests to a service. Ends with its participant.
  class Replier {
   public:
    /// Waits until the client is there to hear it. Discovery may find a client after its request.
    /// @param answer  CDR with its header
    /// @param until   how long it is waited for
    /// Errors: `io_failure` if it is not there by then, or as for a Writer.
    [[nodiscard]] Result<void> reply(const RequestId& id, std::string_view answer,
                                     std::chrono::steady_clock::time_point until);

   private:
    friend class Participant;
    struct State;
    explicit Replier(std::shared_ptr<State> state) : state_(std::move(state)) {}
    std::shared_ptr<State> state_;
  };

  /// Errors: `io_failure` if DDS cannot be started in this domain, for example without a network.
  [[nodiscard]] static Result<Participant> open(const ParticipantOptions& options);
  Participant(Participant&&) noexcept;
  Participant& operator=(Participant&&) noexcept;
  /// No sink is called any more.
  ~Participant();

  /// A sink gets the messages of others, not those of this participant.
  /// Errors: `invalid_input` for a type that is not known (see io::ros::schema_of) or a name that
  /// is no topic; `io_failure` of DDS.
  [[nodiscard]] Result<void> subscribe(const Topic& topic, MessageSink sink);
  [[nodiscard]] Result<Writer> advertise(const Topic& topic);
  /// Serves clients of rmw_fastrtps, whose requests carry the client's Guid beside the message.
  /// Those of other vendors put it into the message, and are not understood.
  /// Errors: as for topics, with io::ros::service_schema_of.
  [[nodiscard]] Result<Replier> serve(const Service& service, RequestSink sink);
  /// Tells others what this node reads and writes (ros_discovery_info). Call after the topics are
  /// there. Errors: `io_failure`.
  [[nodiscard]] Result<void> announce();
  /// The writers that were found for a topic that is read. 0 for one that is not.
  [[nodiscard]] std::size_t writers_of(std::string_view topic) const;
  /// Endpoints of other nodes that are there now and do not fit.
  [[nodiscard]] std::vector<Misfit> misfits() const;
  /// What the kernel makes of ParticipantOptions::receive_buffer: a sentence with the command that
  /// raises its limit, or nothing if the limit is high enough.
  [[nodiscard]] static std::optional<std::string> note_on_buffers(
      const ParticipantOptions& options);

 private:
  struct State;
  explicit Participant(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace vantage::dds
