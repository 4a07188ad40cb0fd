#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace vantage::dds {

/// Another node's endpoint that does not fit one of this node, so that no message passes: by its
/// quality of service, or because its type is another one.
struct Misfit {
  std::string topic = {};       ///< or service, as this node names it
  bool is_read = false;         ///< by this node
  std::string policy = {};      ///< "RELIABILITY", as ROS 2 names it; empty if the types differ
  std::string own_type = {};    ///< "sensor_msgs/PointCloud2", if the types differ
  std::string other_type = {};  ///< as ROS 2 names it, or as it is on the wire

  bool operator==(const Misfit&) const = default;
};

/// Called from threads of DDS.
using MisfitSink = std::function<void(const Misfit& found)>;

/// The endpoints of one node, those of others, and which of them do not fit. DDS tells what it
/// finds in three ways: an endpoint is there, it is matched, or its quality of service does not
/// fit. It says nothing of types that differ. Any thread may call.
class Endpoints {
 public:
  using Guid = std::array<std::uint8_t, 16>;
  /// A topic on the wire, and whether this node reads it.
  using Own = std::pair<std::string, bool>;

  /// @param sink  hears once of each misfit of each endpoint; may be empty
  explicit Endpoints(MisfitSink sink) : sink_(std::move(sink)) {}

  /// An endpoint of this node. Call it before DDS makes the endpoint.
  /// @param shown  its topic or service, as this node names it
  /// @param type   on the wire
  void add(const Own& own, const std::string& shown, const std::string& type);

  /// An endpoint of another node was found. It may be known already.
  /// @param topic, type  on the wire
  void find(const Guid& other, const std::string& topic, const std::string& type, bool is_writer);
  void lose(const Guid& other);
  void match(const Guid& other);
  void unmatch(const Guid& other);
  /// Quality of service does not fit.
  /// @param counts  how often by each policy, since the endpoint was made
  void refuse(const Own& own, const std::map<std::string, std::uint32_t>& counts);

  /// Those that are there now.
  [[nodiscard]] std::vector<Misfit> misfits() const;

 private:
  struct Mine {
    std::string shown, type;
    std::map<std::string, std::uint32_t> counts;  // as DDS told them
  };
  struct Other {
    Own meets;  // such an endpoint of this node, if there is one
    std::string type;
    bool is_matched = false;
    std::set<std::string> policies = {};  // by which it does not fit
  };
  [[nodiscard]] static Misfit other_type(const Mine& mine, const Other& other);
  [[nodiscard]] static Misfit other_policy(const Own& own, const Mine& mine,
                                           const std::string& policy);
  void tell(const std::vector<Misfit>& found) const;

  MisfitSink sink_;
  mutable std::mutex mutex_;
  std::map<Own, Mine> mine_;
  std::map<Guid, Other> others_;
};

}  // namespace vantage::dds
