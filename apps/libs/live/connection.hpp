#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dds/networks.hpp"
#include "dds/participant.hpp"
#include "live/live_params.hpp"
#include "live/notices.hpp"
#include "vantage/result.hpp"

namespace vantage::live {

/// What it means that an endpoint does not fit, in the words of ROS 2, which its users search for.
[[nodiscard]] std::string text_of(const dds::Misfit& found);

/// Those of the topics that a node reads. Nothing for those that it writes: their readers miss
/// something, and this node nothing.
[[nodiscard]] std::vector<std::string> obstacles_of(const std::vector<dds::Misfit>& found);

/// For the participant that [live] describes. It tells which endpoints of others do not fit.
/// @param node     as `ros2 node list` shows it
/// @param notices  must outlive the participant
[[nodiscard]] dds::ParticipantOptions participant_options(const LiveParams& params,
                                                          const std::string& node,
                                                          Notices& notices);

/// Keeps a node connected. A participant is in the networks that are up when it is made. If no
/// network is up then, the connection makes the participant anew once one is. It only reports
/// networks that come up later: a new participant would interrupt the nodes that the old one
/// reaches.
class Connection {
 public:
  using Networks = std::function<std::set<std::string>()>;

  /// @param connect     makes a participant and its topics
  /// @param disconnect  ends the participant, if there is one, and all that belongs to it
  Connection(std::function<Result<void>()> connect, std::function<void()> disconnect,
             Notices& notices, Networks networks = dds::networks);

  /// Errors: those of `connect`.
  [[nodiscard]] Result<void> open();
  /// Looks for networks, once a second. If connecting anew fails, it says so and tries again.
  void follow(std::chrono::steady_clock::time_point now);
  /// Why it is not connected now.
  [[nodiscard]] const std::optional<std::string>& trouble() const noexcept { return trouble_; }

 private:
  [[nodiscard]] Result<void> connect();
  void connect_anew();

  std::function<Result<void>()> connect_;
  std::function<void()> disconnect_;
  Notices& notices_;
  Networks networks_;
  std::set<std::string> reached_;  // by the participant
  std::vector<std::string> told_;  // that came since
  std::optional<std::string> trouble_;
  std::optional<std::chrono::steady_clock::time_point> looked_;
};

}  // namespace vantage::live
