#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "live/notices.hpp"
#include "live/received.hpp"
#include "vantage/result.hpp"

namespace vantage::live {

struct Localized;

/// An answer to a request.
struct Answer {
  Input input;  ///< the service
  dds::RequestId id;
  std::string message;  ///< CDR with its header
};

/// What Autoware's pose initializer asks a localizer for: to leave scans out, to look for the
/// vehicle around a pose, to go on. A request to look for it is answered by the first scan that is
/// tracked, at last after 20 scans or 5 s.
class Requests {
 public:
  /// @param map_frame  of the poses in answers
  Requests(std::string map_frame, Notices& notices)
      : map_frame_(std::move(map_frame)), notices_(notices) {}

  /// Whether what is found is published.
  [[nodiscard]] bool is_on() const noexcept { return is_on_; }
  /// Whether a scan is to be localized.
  [[nodiscard]] bool wants_scan() const noexcept { return is_on_ || align_.has_value(); }

  /// Takes a request to go on or to leave scans out. Errors: those of parse_set_bool.
  [[nodiscard]] Result<void> trigger(const Received& received);
  /// Begins to wait for the vehicle to be found. A request that waits already is refused.
  void align(const Received& received);
  /// Answers that a request cannot be met.
  void refuse(Input input, const dds::RequestId& id, const std::string& why);
  /// A scan that was localized; may answer a request.
  void see(const Localized& scan);
  /// The answers since the last call.
  /// @param now  as Received::arrival [ns]
  [[nodiscard]] std::vector<Answer> take_answers(std::int64_t now);

 private:
  struct Align {
    dds::RequestId id;
    std::int64_t arrival;  // as of Received [ns]
    int scans = 0;
  };
  void answer(Input input, const dds::RequestId& id, Result<std::string> message);

  std::string map_frame_;
  Notices& notices_;
  bool is_on_ = true;
  std::optional<Align> align_;
  std::vector<Answer> answers_;
};

}  // namespace vantage::live
