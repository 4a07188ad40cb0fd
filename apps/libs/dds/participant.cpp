#include "dds/participant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "dds/fast_dds.hpp"
#include "dds/type_hash.hpp"
#include "io/ros/cdr_writer.hpp"
#include "io/ros/schemas.hpp"

namespace vantage::dds {
namespace {

constexpr std::string_view kDiscoveryTopic = "ros_discovery_info";
constexpr std::string_view kDiscoveryType = "rmw_dds_common/ParticipantEntitiesInfo";

/// "sensor_msgs::msg::dds_::PointCloud2_" for "sensor_msgs/PointCloud2".
std::string name_of_type(std::string_view type) {
  const std::size_t slash = type.find('/');
  return fmt::format("{}::msg::dds_::{}_", type.substr(0, slash), type.substr(slash + 1));
}

/// "rt/points" for "/points".
std::string name_of_topic(std::string_view topic) { return fmt::format("rt{}", topic); }

template <class Guid>
std::string bytes_of(const Guid& guid, std::size_t size) {
  std::string bytes(reinterpret_cast<const char*>(guid.guidPrefix.value), 12);
  bytes.append(reinterpret_cast<const char*>(guid.entityId.value), 4);
  bytes.resize(size, '\0');
  return bytes;
}

tl::unexpected<Error> failed(std::string what) {
  return fail(ErrorCode::io_failure, std::move(what) + "; Fast DDS says more on standard error");
}

class Listener final : public fast::DataReaderListener {
 public:
  explicit Listener(MessageSink sink) : sink_(std::move(sink)) {}

  void on_data_available(fast::DataReader* reader) override {
    std::string message;
    fast::SampleInfo info;
    while (is_ok(reader->take_next_sample(&message, &info))) {
      if (info.valid_data) sink_(std::exchange(message, {}));
    }
  }

 private:
  MessageSink sink_;
};

template <class DdsQos>
void apply(const Qos& qos, DdsQos& to) {
  to.reliability().kind =
      qos.reliable ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
  to.durability().kind =
      qos.transient_local ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  to.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  to.history().depth = static_cast<std::int32_t>(qos.depth);
  to.resource_limits().max_samples = 0;  // without a limit
  to.resource_limits().max_samples_per_instance = 0;
  to.data_sharing().off();  // it is for types of one size
}

}  // namespace

struct Participant::Writer::State {
  fast::DataWriter* writer = nullptr;  // DDS owns it
  std::string topic;
};

Result<void> Participant::Writer::write(std::string_view message) {
  if (dds::write(*state_->writer, message)) return {};
  return failed(
      fmt::format("a message of {} bytes for {} could not be sent", message.size(), state_->topic));
}

std::size_t Participant::Writer::readers() const {
  fast::PublicationMatchedStatus status;
  state_->writer->get_publication_matched_status(status);
  return static_cast<std::size_t>(std::max(status.current_count, 0));
}

struct Participant::State {
  explicit State(const ParticipantOptions& the_options) : options(the_options) {}
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (participant == nullptr) return;
    for (const Reader& one : readers) one.reader->set_listener(nullptr);
    participant->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  struct Reader {
    std::string topic;
    fast::DataReader* reader;
    std::unique_ptr<fast::DataReaderListener> listener;
  };

  [[nodiscard]] Result<fast::Topic*> topic_of(const std::string& name, const std::string& type) {
    const std::string dds_type = name_of_type(type);
    if (participant->find_type(dds_type).empty()) {
      const fast::TypeSupport support(new RawType(dds_type));
      if (!is_ok(support.register_type(participant))) {
        return failed("the type " + dds_type + " could not be registered");
      }
    }
    if (auto* const known =
            dynamic_cast<fast::Topic*>(participant->lookup_topicdescription(name))) {
      return known;
    }
    auto* const topic = participant->create_topic(name, dds_type, fast::TOPIC_QOS_DEFAULT);
    if (topic == nullptr) return failed("the topic " + name + " could not be made");
    return topic;
  }

  /// What an endpoint tells others of its type.
  [[nodiscard]] Result<std::vector<std::uint8_t>> user_data(const std::string& type) const {
    if (options.release == Release::humble) return std::vector<std::uint8_t>();
    VANTAGE_TRY(const auto schema, io::ros::schema_of(type));
    VANTAGE_TRY(const std::string hash, type_hash(schema));
    const std::string text = "typehash=" + hash + ";";
    return std::vector<std::uint8_t>(text.begin(), text.end());
  }

  [[nodiscard]] Result<fast::DataWriter*> make_writer(const std::string& name, const Topic& topic) {
    VANTAGE_TRY(fast::Topic* const dds_topic, topic_of(name, topic.type));
    fast::DataWriterQos qos = fast::DATAWRITER_QOS_DEFAULT;
    apply(topic.qos, qos);
    VANTAGE_TRY(const auto data, user_data(topic.type));
    qos.user_data().data_vec(data);
    qos.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;  // large messages go in pieces
    qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    auto* const writer = publisher->create_datawriter(dds_topic, qos);
    if (writer == nullptr) return failed("a writer of " + name + " could not be made");
    return writer;
  }

  ParticipantOptions options;
  fast::DomainParticipant* participant = nullptr;
  fast::Publisher* publisher = nullptr;
  fast::Subscriber* subscriber = nullptr;
  std::vector<Reader> readers;
  std::vector<fast::DataWriter*> writers;
  std::optional<Writer> discovery;
};

namespace {

Result<void> check_name(std::string_view name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '/';
  };
  if (name.size() > 1 && name.front() == '/' && name.back() != '/' &&
      name.find("//") == std::string_view::npos && std::ranges::all_of(name, allowed)) {
    return {};
  }
  return fail(ErrorCode::invalid_input,
              fmt::format("'{}' is not the name of a topic: expected one like /points, of letters, "
                          "digits, '_' and '/'",
                          name));
}

}  // namespace

Participant::Participant(std::unique_ptr<State> state) : state_(std::move(state)) {}
Participant::Participant(Participant&&) noexcept = default;
Participant& Participant::operator=(Participant&&) noexcept = default;
Participant::~Participant() = default;

Result<Participant> Participant::open(const ParticipantOptions& options) {
  auto state = std::make_unique<State>(options);
  fast::DomainParticipantQos qos = fast::PARTICIPANT_QOS_DEFAULT;
  qos.name(options.node);
  constexpr std::string_view kEnclave = "enclave=/;";
  qos.user_data().data_vec(std::vector<std::uint8_t>(kEnclave.begin(), kEnclave.end()));
  qos.transport().use_builtin_transports = false;
  const auto udp = std::make_shared<transports::UDPv4TransportDescriptor>();
  udp->receiveBufferSize = options.receive_buffer;
  udp->sendBufferSize = options.receive_buffer;
  const auto memory = std::make_shared<transports::SharedMemTransportDescriptor>();
  memory->segment_size(options.shared_memory);
  qos.transport().user_transports = {memory, udp};
  state->participant =
      fast::DomainParticipantFactory::get_instance()->create_participant(options.domain, qos);
  if (state->participant == nullptr) {
    return failed(fmt::format("DDS could not be started in domain {}", options.domain));
  }
  state->publisher = state->participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  state->subscriber = state->participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  if (state->publisher == nullptr || state->subscriber == nullptr) {
    return failed("DDS could not make a publisher and a subscriber");
  }
  return Participant(std::move(state));
}

Result<void> Participant::subscribe(const Topic& topic, MessageSink sink) {
  VANTAGE_CHECK(check_name(topic.name));
  VANTAGE_TRY(fast::Topic* const dds_topic,
              state_->topic_of(name_of_topic(topic.name), topic.type));
  fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
  apply(topic.qos, qos);
  VANTAGE_TRY(const auto data, state_->user_data(topic.type));
  qos.user_data().data_vec(data);
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  auto listener = std::make_unique<Listener>(std::move(sink));
  auto* const reader = state_->subscriber->create_datareader(dds_topic, qos, listener.get());
  if (reader == nullptr) return failed("a reader of " + topic.name + " could not be made");
  state_->readers.push_back({topic.name, reader, std::move(listener)});
  return {};
}

Result<Participant::Writer> Participant::advertise(const Topic& topic) {
  VANTAGE_CHECK(check_name(topic.name));
  VANTAGE_TRY(fast::DataWriter* const writer,
              state_->make_writer(name_of_topic(topic.name), topic));
  state_->writers.push_back(writer);
  return Writer(std::make_shared<Writer::State>(Writer::State{writer, topic.name}));
}

Result<void> Participant::announce() {
  State& s = *state_;
  if (!s.discovery) {
    const Topic topic{.name = std::string(kDiscoveryTopic),
                      .type = std::string(kDiscoveryType),
                      .qos = {.reliable = true, .transient_local = true, .depth = 1}};
    VANTAGE_TRY(fast::DataWriter* const writer, s.make_writer(topic.name, topic));
    s.discovery = Writer(std::make_shared<Writer::State>(Writer::State{writer, topic.name}));
  }
  const std::size_t size = s.options.release == Release::humble ? 24 : 16;
  io::ros::CdrWriter message;
  message.raw(bytes_of(s.participant->guid(), size));
  message.count(1);
  message.text("/");
  message.text(s.options.node);
  message.count(s.readers.size());
  for (const State::Reader& one : s.readers) message.raw(bytes_of(one.reader->guid(), size));
  message.count(s.writers.size());
  for (const fast::DataWriter* writer : s.writers) message.raw(bytes_of(writer->guid(), size));
  VANTAGE_TRY(const std::string bytes, std::move(message).finish());
  return s.discovery->write(bytes);
}

std::size_t Participant::writers_of(std::string_view topic) const {
  for (const State::Reader& one : state_->readers) {
    if (one.topic != topic) continue;
    fast::SubscriptionMatchedStatus status;
    one.reader->get_subscription_matched_status(status);
    return static_cast<std::size_t>(std::max(status.current_count, 0));
  }
  return 0;
}

std::optional<std::string> Participant::note_on_buffers(const ParticipantOptions& options) {
  std::ifstream file("/proc/sys/net/core/rmem_max");
  std::uint64_t limit = 0;
  if (!(file >> limit) || limit >= options.receive_buffer) return std::nullopt;
  return fmt::format(
      "the kernel gives a socket at most {} bytes to receive into, and clouds over the network "
      "want "
      "{}: sudo sysctl -w net.core.rmem_max={}",
      limit, options.receive_buffer, options.receive_buffer);
}

}  // namespace vantage::dds
