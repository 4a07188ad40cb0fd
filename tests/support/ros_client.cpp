#include "support/ros_client.hpp"

#include <chrono>
#include <map>
#include <stdexcept>
#include <thread>

#include "dds/fast_dds.hpp"

namespace vantage::test {
namespace {

std::int64_t number_of(const dds::rtps::SampleIdentity& identity) {
  const auto number = identity.sequence_number();
  return (static_cast<std::int64_t>(number.high) << 32) | number.low;
}

void wait_a_little() { std::this_thread::sleep_for(std::chrono::milliseconds(5)); }

void require(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(what);
}

}  // namespace

struct RosClient::State {
  dds::fast::DomainParticipant* participant = nullptr;
  dds::fast::DataReader* reader = nullptr;
  dds::fast::DataWriter* writer = nullptr;
  std::map<std::int64_t, std::string> answers;

  ~State() {
    if (participant == nullptr) return;
    participant->delete_contained_entities();
    dds::fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }
};

RosClient::RosClient(std::uint32_t domain, const std::string& service, const std::string& type)
    : state_(std::make_unique<State>()) {
  namespace fast = dds::fast;
  auto* const participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      domain, fast::PARTICIPANT_QOS_DEFAULT);
  require(participant != nullptr, "no participant");
  state_->participant = participant;
  const auto topic = [&](const std::string& name, const std::string& of_type) {
    const fast::TypeSupport support(new dds::RawType(of_type));
    require(dds::is_ok(support.register_type(participant)), "no type");
    return participant->create_topic(name, of_type, fast::TOPIC_QOS_DEFAULT);
  };
  constexpr std::int32_t kDepth = 10;  // as rmw_qos_profile_services_default
  fast::DataWriterQos writing = fast::DATAWRITER_QOS_DEFAULT;
  writing.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  writing.history().depth = kDepth;
  writing.endpoint().history_memory_policy = dds::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  fast::DataReaderQos reading = fast::DATAREADER_QOS_DEFAULT;
  reading.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  reading.history().depth = kDepth;
  reading.endpoint().history_memory_policy = dds::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  state_->reader =
      participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
          ->create_datareader(topic("rr" + service + "Reply", type + "Response_"), reading);
  state_->writer =
      participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)
          ->create_datawriter(topic("rq" + service + "Request", type + "Request_"), writing);
  require(state_->reader != nullptr && state_->writer != nullptr, "no reader and writer");
}

RosClient::~RosClient() = default;

void RosClient::wait_for_server() const {
  dds::fast::PublicationMatchedStatus requests;
  dds::fast::SubscriptionMatchedStatus answers;
  while (requests.current_count == 0 || answers.current_count == 0) {
    wait_a_little();
    state_->writer->get_publication_matched_status(requests);
    state_->reader->get_subscription_matched_status(answers);
  }
}

std::int64_t RosClient::send(std::string_view request) {
  dds::rtps::WriteParams parameters;
  parameters.related_sample_identity().writer_guid(state_->reader->guid());
  require(dds::is_ok(state_->writer->write(&request, parameters)), "a request was not sent");
  return number_of(parameters.sample_identity());
}

std::string RosClient::answer_to(std::int64_t number) {
  auto& answers = state_->answers;
  while (!answers.contains(number)) {
    std::string message;
    dds::fast::SampleInfo info;
    if (!dds::is_ok(state_->reader->take_next_sample(&message, &info))) {
      wait_a_little();
      continue;
    }
    // Answers to other clients come, too.
    if (info.related_sample_identity.writer_guid() != state_->reader->guid()) continue;
    answers[number_of(info.related_sample_identity)] = message;
  }
  return answers[number];
}

}  // namespace vantage::test
