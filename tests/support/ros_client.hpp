#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace vantage::test {

/// A client of one service, which does what rmw_fastrtps does: the Guid of its reader of answers
/// goes with each request, and comes back with the answer. Throws if DDS refuses.
class RosClient {
 public:
  /// @param service  "/localization/trigger"
  /// @param type     "std_srvs::srv::dds_::SetBool_"
  RosClient(std::uint32_t domain, const std::string& service, const std::string& type);
  ~RosClient();
  RosClient(const RosClient&) = delete;
  RosClient& operator=(const RosClient&) = delete;

  /// Until there is one, as `service_is_available` of ROS 2 sees it.
  void wait_for_server() const;
  /// @param request  CDR with its header
  /// @return the number of the request
  std::int64_t send(std::string_view request);
  /// Waits for the answer to a request.
  std::string answer_to(std::int64_t number);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vantage::test
