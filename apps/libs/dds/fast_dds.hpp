#pragma once

// What differs between Fast DDS 2 (Debian 12) and 3 (Debian 13), and nothing else.

#include <cstdint>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <string>
#include <string_view>

#if __has_include(<fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>)
#define VANTAGE_FAST_DDS_3
#include <fastdds/rtps/common/WriteParams.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.hpp>
#else
#include <fastdds/rtps/common/WriteParams.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#endif

namespace vantage::dds {

namespace fast = eprosima::fastdds::dds;

#ifdef VANTAGE_FAST_DDS_3
namespace rtps = eprosima::fastdds::rtps;
inline bool is_ok(fast::ReturnCode_t code) { return code == fast::RETCODE_OK; }
#else
namespace rtps = eprosima::fastrtps::rtps;
inline bool is_ok(const eprosima::fastrtps::types::ReturnCode_t& code) {
  return code == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
}
#endif
namespace transports = eprosima::fastdds::rtps;

/// A type whose messages are bytes that are encoded already (CDR with its header of 4 bytes). What
/// is written is a std::string_view, what is read is put into a std::string.
class RawType final : public fast::TopicDataType {
 public:
  /// @param name  "sensor_msgs::msg::dds_::PointCloud2_"
  explicit RawType(const std::string& name) {
    constexpr std::uint32_t kFirstSize = 4096;  // [bytes]; more is allocated as needed
#ifdef VANTAGE_FAST_DDS_3
    set_name(name);
    max_serialized_type_size = kFirstSize;
    is_compute_key_provided = false;
#else
    setName(name.c_str());
    m_typeSize = kFirstSize;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
#endif
  }

#ifdef VANTAGE_FAST_DDS_3
  bool serialize(const void* const data, rtps::SerializedPayload_t& payload,
                 fast::DataRepresentationId_t) override {
    return put(*static_cast<const std::string_view*>(data), payload);
  }
  bool deserialize(rtps::SerializedPayload_t& payload, void* data) override {
    return get(payload, data);
  }
  std::uint32_t calculate_serialized_size(const void* const data,
                                          fast::DataRepresentationId_t) override {
    return static_cast<std::uint32_t>(static_cast<const std::string_view*>(data)->size());
  }
  void* create_data() override { return new std::string; }
  void delete_data(void* data) override { delete static_cast<std::string*>(data); }
  bool compute_key(rtps::SerializedPayload_t&, rtps::InstanceHandle_t&, bool) override {
    return false;
  }
  bool compute_key(const void* const, rtps::InstanceHandle_t&, bool) override { return false; }
#else
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    return put(*static_cast<const std::string_view*>(data), *payload);
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    return get(*payload, data);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    const auto size =
        static_cast<std::uint32_t>(static_cast<const std::string_view*>(data)->size());
    return [size] { return size; };
  }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
#endif

 private:
  static bool put(std::string_view bytes, rtps::SerializedPayload_t& payload) {
    if (bytes.size() > payload.max_size) return false;
    std::memcpy(payload.data, bytes.data(), bytes.size());
    payload.length = static_cast<std::uint32_t>(bytes.size());
    payload.encapsulation = CDR_LE;
    return true;
  }
  static bool get(const rtps::SerializedPayload_t& payload, void* data) {
    static_cast<std::string*>(data)->assign(reinterpret_cast<const char*>(payload.data),
                                            payload.length);
    return true;
  }
};

/// An endpoint that discovery found, or lost.
struct Discovered {
  rtps::GUID_t guid;
  const char *topic, *type;  ///< on the wire
  bool is_writer;
  bool is_gone;
};

/// Hears of the endpoints of all nodes.
class DiscoveryListener final : public fast::DomainParticipantListener {
 public:
  using Sink = std::function<void(const fast::DomainParticipant& own, const Discovered& found)>;
  explicit DiscoveryListener(Sink sink) : sink_(std::move(sink)) {}

#ifdef VANTAGE_FAST_DDS_3
  void on_data_reader_discovery(fast::DomainParticipant* own, rtps::ReaderDiscoveryStatus reason,
                                const fast::SubscriptionBuiltinTopicData& info, bool&) override {
    tell(*own, info, false, reason == rtps::ReaderDiscoveryStatus::REMOVED_READER);
  }
  void on_data_writer_discovery(fast::DomainParticipant* own, rtps::WriterDiscoveryStatus reason,
                                const fast::PublicationBuiltinTopicData& info, bool&) override {
    tell(*own, info, true, reason == rtps::WriterDiscoveryStatus::REMOVED_WRITER);
  }
#else
  void on_subscriber_discovery(fast::DomainParticipant* own,
                               rtps::ReaderDiscoveryInfo&& found) override {
    tell(*own, found.info, false, found.status == rtps::ReaderDiscoveryInfo::REMOVED_READER);
  }
  void on_publisher_discovery(fast::DomainParticipant* own,
                              rtps::WriterDiscoveryInfo&& found) override {
    tell(*own, found.info, true, found.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER);
  }
#endif

 private:
  template <class Info>
  void tell(const fast::DomainParticipant& own, const Info& info, bool is_writer, bool is_gone) {
#ifdef VANTAGE_FAST_DDS_3
    sink_(own, {info.guid, info.topic_name.c_str(), info.type_name.c_str(), is_writer, is_gone});
#else
    sink_(own,
          {info.guid(), info.topicName().c_str(), info.typeName().c_str(), is_writer, is_gone});
#endif
  }

  Sink sink_;
};

inline bool is_ok(bool taken) { return taken; }

/// Writes a message. @return whether it was taken
inline bool write(fast::DataWriter& writer, std::string_view message) {
  return is_ok(writer.write(&message));
}
/// As the answer to a request, or with what names a client. @return whether it was taken
inline bool write(fast::DataWriter& writer, std::string_view message,
                  const rtps::SampleIdentity& related) {
  rtps::WriteParams parameters;
  parameters.related_sample_identity(related);
  return is_ok(writer.write(&message, parameters));
}

}  // namespace vantage::dds
