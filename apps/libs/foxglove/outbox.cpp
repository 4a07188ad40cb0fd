#include "foxglove/outbox.hpp"

#include <utility>

#include "foxglove/status.hpp"

namespace vantage::foxglove {
namespace {

/// With what a small message takes beside its bytes.
std::size_t size_of(const Frame& frame) {
  constexpr std::size_t kRest = 64;
  return kRest + frame.head.size() + (frame.body ? frame.body->size() : 0);
}

}  // namespace

void Outbox::tell(std::string text) {
  told_bytes_ += text.size();
  told_.push_back(std::move(text));
}

Outbox::Waiting Outbox::take(std::deque<Waiting>& from) {
  Waiting first = std::move(from.front());
  from.pop_front();
  bytes_ -= size_of(first.frame);
  return first;
}

void Outbox::put(Frame frame, bool is_latched) {
  const std::size_t size = size_of(frame);
  while (bytes_ > 0 && bytes_ + size > most_) {
    (void)take(passing_.empty() ? latched_ : passing_);
    if (!std::exchange(has_told_loss_, true)) tells_loss_ = true;
  }
  bytes_ += size;
  (is_latched ? latched_ : passing_).push_back({numbers_++, std::move(frame)});
}

std::optional<Frame> Outbox::next() {
  if (!told_.empty()) {
    Frame frame{.is_text = true, .head = std::move(told_.front())};
    told_.pop_front();
    told_bytes_ -= frame.head.size();
    return frame;
  }
  if (std::exchange(tells_loss_, false)) {
    return Frame{.is_text = true,
                 .head = status(Level::warning,
                                "the connection is slower than what is sent: messages are left out",
                                "left_out")};
  }
  if (passing_.empty() && latched_.empty()) {
    has_told_loss_ = false;
    return std::nullopt;
  }
  const bool is_latched =
      passing_.empty() || (!latched_.empty() && latched_.front().number < passing_.front().number);
  return take(is_latched ? latched_ : passing_).frame;
}

}  // namespace vantage::foxglove
