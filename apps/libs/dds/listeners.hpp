#pragma once

// What DDS tells this node, in threads of DDS.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "dds/endpoints.hpp"
#include "dds/fast_dds.hpp"

namespace vantage::dds {

[[nodiscard]] Endpoints::Guid guid_of(const rtps::GUID_t& guid);
[[nodiscard]] Endpoints::Guid guid_of(const rtps::InstanceHandle_t& handle);

/// What DDS tells of the endpoints that one of this node meets.
class Meeting {
 public:
  Meeting(Endpoints& endpoints, Endpoints::Own own) : endpoints_(endpoints), own_(std::move(own)) {}

  /// @param change  1 or -1
  /// @param last    the endpoint that came or went
  void see_match(std::int32_t change, const rtps::InstanceHandle_t& last) const;
  /// An endpoint may not fit by several policies. The status names the last only, and counts all.
  void see_misfits(const fast::QosPolicyCountSeq& policies) const;

 private:
  Endpoints& endpoints_;
  Endpoints::Own own_;
};

class ReaderListener final : public fast::DataReaderListener {
 public:
  using Sink = std::function<void(const fast::SampleInfo& info, std::string&& message)>;
  ReaderListener(Sink sink, Meeting meeting)
      : sink_(std::move(sink)), meeting_(std::move(meeting)) {}

  void on_requested_incompatible_qos(fast::DataReader*,
                                     const fast::RequestedIncompatibleQosStatus& status) override {
    meeting_.see_misfits(status.policies);
  }
  void on_subscription_matched(fast::DataReader*,
                               const fast::SubscriptionMatchedStatus& status) override {
    meeting_.see_match(status.current_count_change, status.last_publication_handle);
  }
  void on_data_available(fast::DataReader* reader) override;

 private:
  Sink sink_;
  Meeting meeting_;
};

class WriterListener : public fast::DataWriterListener {
 public:
  explicit WriterListener(Meeting meeting) : meeting_(std::move(meeting)) {}

  void on_offered_incompatible_qos(fast::DataWriter*,
                                   const fast::OfferedIncompatibleQosStatus& status) override {
    meeting_.see_misfits(status.policies);
  }
  void on_publication_matched(fast::DataWriter*,
                              const fast::PublicationMatchedStatus& status) override {
    meeting_.see_match(status.current_count_change, status.last_subscription_handle);
  }

 private:
  Meeting meeting_;
};

}  // namespace vantage::dds
