#pragma once

#include <doctest/doctest.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <thread>

#include "dds/fast_dds.hpp"

namespace vantage::test {

/// A client of one service, which does what rmw_fastrtps does: the Guid of its reader of answers
/// goes with each request, and comes back with the answer.
class RosClient {
 public:
  /// @param service  "/localization/trigger"
  /// @param type     "std_srvs::srv::dds_::SetBool_"
  RosClient(std::uint32_t domain, const std::string& service, const std::string& type) {
    namespace fast = dds::fast;
    participant_ = fast::DomainParticipantFactory::get_instance()->create_participant(
        domain, fast::PARTICIPANT_QOS_DEFAULT);
    REQUIRE(participant_ != nullptr);
    const auto topic = [&](const std::string& name, const std::string& of_type) {
      REQUIRE(dds::is_ok(fast::TypeSupport(new dds::RawType(of_type)).register_type(participant_)));
      return participant_->create_topic(name, of_type, fast::TOPIC_QOS_DEFAULT);
    };
    fast::DataWriterQos writing = fast::DATAWRITER_QOS_DEFAULT;
    writing.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    writing.endpoint().history_memory_policy = dds::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    writing.history().depth = 10;  // as rmw_qos_profile_services_default
    fast::DataReaderQos reading = fast::DATAREADER_QOS_DEFAULT;
    reading.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    reading.history().depth = 10;
    reading.endpoint().history_memory_policy = dds::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    reader_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
                  ->create_datareader(topic("rr" + service + "Reply", type + "Response_"), reading);
    writer_ =
        participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT)
            ->create_datawriter(topic("rq" + service + "Request", type + "Request_"), writing);
    REQUIRE(reader_ != nullptr);
    REQUIRE(writer_ != nullptr);
  }
  ~RosClient() {
    participant_->delete_contained_entities();
    dds::fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  RosClient(const RosClient&) = delete;
  RosClient& operator=(const RosClient&) = delete;

  /// Whether a server is there, as `service_is_available` of ROS 2 sees it.
  [[nodiscard]] bool finds_server() const {
    dds::fast::PublicationMatchedStatus requests;
    dds::fast::SubscriptionMatchedStatus answers;
    writer_->get_publication_matched_status(requests);
    reader_->get_subscription_matched_status(answers);
    return requests.current_count > 0 && answers.current_count > 0;
  }
  void wait_for_server() const {
    while (!finds_server()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }

  /// @return the number of the request
  std::int64_t send(std::string_view request) {
    dds::rtps::WriteParams parameters;
    parameters.related_sample_identity().writer_guid(reader_->guid());
    REQUIRE(dds::is_ok(writer_->write(&request, parameters)));
    return number_of(parameters.sample_identity());
  }

  /// Waits for the answer to a request.
  std::string answer_to(std::int64_t number) {
    while (!answers_.contains(number)) {
      std::string message;
      dds::fast::SampleInfo info;
      if (!dds::is_ok(reader_->take_next_sample(&message, &info))) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        continue;
      }
      // Answers to other clients come, too.
      if (info.related_sample_identity.writer_guid() != reader_->guid()) continue;
      answers_[number_of(info.related_sample_identity)] = message;
    }
    return answers_[number];
  }

 private:
  static std::int64_t number_of(const dds::rtps::SampleIdentity& identity) {
    const auto number = identity.sequence_number();
    return (static_cast<std::int64_t>(number.high) << 32) | number.low;
  }

  dds::fast::DomainParticipant* participant_;
  dds::fast::DataReader* reader_ = nullptr;
  dds::fast::DataWriter* writer_ = nullptr;
  std::map<std::int64_t, std::string> answers_;
};

}  // namespace vantage::test
