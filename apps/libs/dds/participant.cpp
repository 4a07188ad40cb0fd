#include "dds/participant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dds/endpoints.hpp"
#include "dds/fast_dds.hpp"
#include "dds/listeners.hpp"
#include "dds/names.hpp"
#include "dds/type_hash.hpp"
#include "io/ros/cdr_writer.hpp"
#include "io/ros/schemas.hpp"

namespace vantage::dds {
namespace {

constexpr std::string_view kDiscoveryTopic = "ros_discovery_info";
constexpr std::string_view kDiscoveryType = "rmw_dds_common/ParticipantEntitiesInfo";

std::string bytes_of(const rtps::GUID_t& guid, std::size_t size) {
  const Endpoints::Guid all = guid_of(guid);
  std::string bytes(all.begin(), all.end());
  bytes.resize(size, '\0');
  return bytes;
}

tl::unexpected<Error> failed(std::string what) {
  return fail(ErrorCode::io_failure, std::move(what) + "; Fast DDS says more on standard error");
}

/// The client is named by what is related to a request, or by the writer of it.
RequestId request_id(const fast::SampleInfo& info) {
  const rtps::GUID_t& related = info.related_sample_identity.writer_guid();
  const rtps::GUID_t& client =
      related == rtps::GUID_t::unknown() ? info.sample_identity.writer_guid() : related;
  RequestId id;
  id.client = guid_of(client);
  const rtps::SequenceNumber_t& number = info.sample_identity.sequence_number();
  id.number = (static_cast<std::int64_t>(number.high) << 32U) | number.low;
  return id;
}

rtps::SampleIdentity identity_of(const RequestId& id) {
  rtps::GUID_t client;
  std::copy_n(id.client.begin(), 12, client.guidPrefix.value);
  std::copy_n(id.client.begin() + 12, 4, client.entityId.value);
  rtps::SampleIdentity identity;
  identity.writer_guid(client);
  identity.sequence_number(
      {static_cast<std::int32_t>(id.number >> 32), static_cast<std::uint32_t>(id.number)});
  return identity;
}

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

/// Knows the clients that were found.
struct Participant::Replier::State final : WriterListener {
  using Guid = decltype(RequestId::client);
  using WriterListener::WriterListener;

  void on_publication_matched(fast::DataWriter* own,
                              const fast::PublicationMatchedStatus& status) override {
    WriterListener::on_publication_matched(own, status);
    const std::scoped_lock lock(mutex);
    const Guid client = guid_of(status.last_subscription_handle);
    if (status.current_count_change > 0) {
      clients.insert(client);
    } else {
      clients.erase(client);
    }
    changed.notify_all();
  }

  fast::DataWriter* writer = nullptr;  // DDS owns it
  std::string service;
  std::mutex mutex;
  std::condition_variable changed;
  std::set<Guid> clients;
};

Result<void> Participant::Replier::reply(const RequestId& id, std::string_view answer,
                                         std::chrono::steady_clock::time_point until) {
  {
    std::unique_lock lock(state_->mutex);
    const auto is_there = [&] { return state_->clients.contains(id.client); };
    if (!state_->changed.wait_until(lock, until, is_there)) {
      return fail(ErrorCode::io_failure,
                  fmt::format("the client of {} went away before its answer", state_->service));
    }
  }
  if (dds::write(*state_->writer, answer, identity_of(id))) return {};
  return failed(fmt::format("an answer of {} could not be sent", state_->service));
}

struct Participant::State {
  explicit State(const ParticipantOptions& the_options)
      : options(the_options), endpoints(the_options.misfit) {}
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (participant == nullptr) return;
    for (const Reader& one : readers) one.reader->set_listener(nullptr);
    for (const Writing& one : writers) one.writer->set_listener(nullptr);
    participant->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  struct Reader {
    std::string topic;
    fast::DataReader* reader;
    std::unique_ptr<fast::DataReaderListener> listener;
  };
  struct Writing {
    fast::DataWriter* writer;
    std::shared_ptr<WriterListener> listener;
  };

  /// What this node finds on a topic of its own.
  /// @param name   on the wire
  /// @param shown  as this node names it
  [[nodiscard]] Meeting meeting(const std::string& name, const std::string& shown,
                                const std::string& dds_type, bool is_read) {
    const Endpoints::Own own{name, is_read};
    endpoints.add(own, shown, dds_type);
    return {endpoints, own};
  }

  void discover(const fast::DomainParticipant& own, const Discovered& found) {
    if (found.guid.guidPrefix == own.guid().guidPrefix) return;
    if (found.is_gone) return endpoints.lose(guid_of(found.guid));
    endpoints.find(guid_of(found.guid), found.topic, found.type, found.is_writer);
  }

  /// @param dds_type  see name_of_type
  [[nodiscard]] Result<fast::Topic*> topic_of(const std::string& name,
                                              const std::string& dds_type) {
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
  [[nodiscard]] Result<std::vector<std::uint8_t>> user_data(
      const io::ros::MessageSchema& schema) const {
    if (options.release == Release::humble) return std::vector<std::uint8_t>();
    VANTAGE_TRY(const std::string hash, type_hash(schema));
    const std::string text = "typehash=" + hash + ";";
    return std::vector<std::uint8_t>(text.begin(), text.end());
  }

  /// @param name  on the wire
  [[nodiscard]] Result<fast::DataWriter*> make_writer(const std::string& name,
                                                      const std::string& dds_type, const Qos& how,
                                                      const io::ros::MessageSchema& schema,
                                                      WriterListener* listener) {
    VANTAGE_TRY(fast::Topic* const topic, topic_of(name, dds_type));
    fast::DataWriterQos qos = fast::DATAWRITER_QOS_DEFAULT;
    apply(how, qos);
    VANTAGE_TRY(const auto data, user_data(schema));
    qos.user_data().data_vec(data);
    qos.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;  // large messages go in pieces
    qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    auto* const writer = publisher->create_datawriter(topic, qos, listener);
    if (writer == nullptr) return failed("a writer of " + name + " could not be made");
    return writer;
  }
  [[nodiscard]] Result<fast::DataWriter*> make_writer(const std::string& name, const Topic& topic,
                                                      WriterListener* listener) {
    VANTAGE_TRY(const auto schema, io::ros::schema_of(topic.type));
    return make_writer(name, name_of_type(topic.type), topic.qos, schema, listener);
  }

  [[nodiscard]] Result<void> make_reader(const std::string& name, const std::string& dds_type,
                                         const Qos& how, const io::ros::MessageSchema& schema,
                                         const std::string& shown_name, ReaderListener::Sink sink) {
    VANTAGE_TRY(fast::Topic* const topic, topic_of(name, dds_type));
    fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
    apply(how, qos);
    VANTAGE_TRY(const auto data, user_data(schema));
    qos.user_data().data_vec(data);
    qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    auto listener = std::make_unique<ReaderListener>(std::move(sink),
                                                     meeting(name, shown_name, dds_type, true));
    auto* const reader = subscriber->create_datareader(topic, qos, listener.get());
    if (reader == nullptr) return failed("a reader of " + name + " could not be made");
    readers.push_back({shown_name, reader, std::move(listener)});
    return {};
  }

  ParticipantOptions options;
  Endpoints endpoints;
  DiscoveryListener discovery_listener{[this](const fast::DomainParticipant& own,
                                              const Discovered& found) { discover(own, found); }};
  fast::DomainParticipant* participant = nullptr;
  fast::Publisher* publisher = nullptr;
  fast::Subscriber* subscriber = nullptr;
  std::vector<Reader> readers;
  std::vector<Writing> writers;
  std::optional<Writer> discovery;
};

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
  state->participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      options.domain, qos, &state->discovery_listener, fast::StatusMask::none());
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
  VANTAGE_TRY(const auto schema, io::ros::schema_of(topic.type));
  return state_->make_reader(
      name_of_topic(topic.name), name_of_type(topic.type), topic.qos, schema, topic.name,
      [sink = std::move(sink)](const fast::SampleInfo&, std::string&& message) {
        sink(std::move(message));
      });
}

Result<Participant::Writer> Participant::advertise(const Topic& topic) {
  VANTAGE_CHECK(check_name(topic.name));
  const std::string name = name_of_topic(topic.name);
  auto listener = std::make_unique<WriterListener>(
      state_->meeting(name, topic.name, name_of_type(topic.type), false));
  VANTAGE_TRY(fast::DataWriter* const writer, state_->make_writer(name, topic, listener.get()));
  state_->writers.push_back({writer, std::move(listener)});
  return Writer(std::make_shared<Writer::State>(Writer::State{writer, topic.name}));
}

Result<Participant::Replier> Participant::serve(const Service& service, RequestSink sink) {
  VANTAGE_CHECK(check_name(service.name));
  VANTAGE_TRY(const auto schema, io::ros::service_schema_of(service.type));
  constexpr Qos kQos{.reliable = true, .transient_local = false, .depth = 10};
  const std::string answers = fmt::format("rr{}Reply", service.name);
  const std::string answer_type = name_of_type(service.type, "srv", "_Response");
  const auto replier =
      std::make_shared<Replier::State>(state_->meeting(answers, service.name, answer_type, false));
  replier->service = service.name;
  VANTAGE_TRY(replier->writer,
              state_->make_writer(answers, answer_type, kQos, schema, replier.get()));
  state_->writers.push_back({replier->writer, replier});
  VANTAGE_CHECK(state_->make_reader(
      fmt::format("rq{}Request", service.name), name_of_type(service.type, "srv", "_Request"), kQos,
      schema, service.name,
      [sink = std::move(sink)](const fast::SampleInfo& info, std::string&& request) {
        sink(request_id(info), std::move(request));
      }));
  return Replier(replier);
}

Result<void> Participant::announce() {
  State& s = *state_;
  if (!s.discovery) {
    const Topic topic{.name = std::string(kDiscoveryTopic),
                      .type = std::string(kDiscoveryType),
                      .qos = {.reliable = true, .transient_local = true, .depth = 1}};
    VANTAGE_TRY(fast::DataWriter* const writer, s.make_writer(topic.name, topic, nullptr));
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
  for (const State::Writing& one : s.writers) message.raw(bytes_of(one.writer->guid(), size));
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

std::vector<Misfit> Participant::misfits() const { return state_->endpoints.misfits(); }

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
