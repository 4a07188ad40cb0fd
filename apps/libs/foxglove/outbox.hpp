#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace vantage::foxglove {

/// A message of WebSocket: its bytes are those of `head`, then those of `body`.
struct Frame {
  bool is_text = false;
  std::string head;
  std::shared_ptr<const std::string> body = nullptr;  ///< clients share it
};

/// What waits for one client, within a limit of bytes. If a client reads more slowly than messages
/// come, the oldest messages are dropped. The client is told so once, and again only after it has
/// caught up. Of a latched topic, a client needs the latest messages, however large: as many wait
/// as the topic keeps, and none is dropped for another topic.
class Outbox {
 public:
  /// A topic whose messages are kept for those who come later.
  struct Latched {
    std::uint32_t channel;
    std::size_t depth;  ///< messages that are kept
  };

  /// @param most  bytes of messages that may wait, beside those of latched topics; one alone may be
  ///              larger
  explicit Outbox(std::size_t most) : most_(most) {}

  /// Adds an answer or an announcement; none is left out.
  void tell(std::string text);
  /// Adds a message of a topic.
  /// @param latched  if its topic is
  void put(Frame frame, const std::optional<Latched>& latched);
  /// What is sent next; nothing if nothing waits.
  [[nodiscard]] std::optional<Frame> next();

  /// The client does not take what it is told: too much of it waits.
  [[nodiscard]] bool is_deaf() const noexcept { return told_bytes_ > kMostTold; }
  [[nodiscard]] std::size_t waiting_bytes() const noexcept { return bytes_; }

 private:
  static constexpr std::size_t kMostTold = 1U << 20U;
  struct Waiting {
    std::uint64_t number;  // in the order of arrival
    Frame frame;
    std::uint32_t channel;  // if it is latched
  };
  void make_room(std::size_t size);
  void replace_oldest(const Latched& latched);
  void lose() {
    if (!std::exchange(has_told_loss_, true)) tells_loss_ = true;
  }
  [[nodiscard]] Waiting take(std::deque<Waiting>& from);

  std::size_t most_;
  std::deque<std::string> told_;
  std::deque<Waiting> passing_, latched_;
  std::size_t told_bytes_ = 0, bytes_ = 0;
  std::uint64_t numbers_ = 0;
  bool tells_loss_ = false, has_told_loss_ = false;
};

}  // namespace vantage::foxglove
