#include "dds/listeners.hpp"

#include <fmt/format.h>

namespace vantage::dds {
namespace {

/// As ROS 2 names a policy of QoS.
std::string name_of(fast::QosPolicyId_t policy) {
  switch (policy) {
    case fast::DURABILITY_QOS_POLICY_ID: return "DURABILITY";
    case fast::DEADLINE_QOS_POLICY_ID: return "DEADLINE";
    case fast::LIVELINESS_QOS_POLICY_ID: return "LIVELINESS";
    case fast::RELIABILITY_QOS_POLICY_ID: return "RELIABILITY";
    default: return fmt::format("policy {} of DDS", static_cast<int>(policy));
  }
}

}  // namespace

Endpoints::Guid guid_of(const rtps::GUID_t& guid) {
  Endpoints::Guid bytes{};
  std::copy_n(guid.guidPrefix.value, 12, bytes.begin());
  std::copy_n(guid.entityId.value, 4, bytes.begin() + 12);
  return bytes;
}

Endpoints::Guid guid_of(const rtps::InstanceHandle_t& handle) {
  Endpoints::Guid bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = handle.value[i];
  return bytes;
}

void Meeting::see_match(std::int32_t change, const rtps::InstanceHandle_t& last) const {
  if (change > 0) endpoints_.match(guid_of(last));
  if (change < 0) endpoints_.unmatch(guid_of(last));
}

void Meeting::see_misfits(const fast::QosPolicyCountSeq& policies) const {
  std::map<std::string, std::uint32_t> counts;
  for (const fast::QosPolicyCount& one : policies) {
    if (one.count > 0) counts[name_of(one.policy_id)] = static_cast<std::uint32_t>(one.count);
  }
  endpoints_.refuse(own_, counts);
}

void ReaderListener::on_data_available(fast::DataReader* reader) {
  std::string message;
  fast::SampleInfo info;
  while (is_ok(reader->take_next_sample(&message, &info))) {
    const rtps::GUID_t& writer = info.sample_identity.writer_guid();
    if (!info.valid_data || writer.guidPrefix == reader->guid().guidPrefix) continue;
    sink_(info, std::exchange(message, {}));
  }
}

}  // namespace vantage::dds
