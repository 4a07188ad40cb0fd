#include "foxglove/outbox.hpp"

#include <algorithm>
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

/// Drops what passes, the oldest first.
void Outbox::make_room(std::size_t size) {
  while (!passing_.empty() && bytes_ + size > most_) {
    (void)take(passing_);
    lose();
  }
}

/// A latched message takes the place of the oldest of its topic that waits, if as many wait as the
/// topic keeps. Nothing is lost: who comes later does not get the oldest, either.
void Outbox::replace_oldest(const Latched& latched) {
  const auto is_same = [&](const Waiting& one) { return one.channel == latched.channel; };
  if (static_cast<std::size_t>(std::ranges::count_if(latched_, is_same)) < latched.depth) return;
  const auto oldest = std::ranges::find_if(latched_, is_same);
  if (oldest == latched_.end()) return;
  bytes_ -= size_of(oldest->frame);
  latched_.erase(oldest);
}

void Outbox::put(Frame frame, const std::optional<Latched>& latched) {
  const std::size_t size = size_of(frame);
  if (latched) replace_oldest(*latched);
  make_room(size);
  if (!latched && bytes_ > 0 && bytes_ + size > most_) return lose();
  bytes_ += size;
  if (latched) {
    latched_.push_back({numbers_++, std::move(frame), latched->channel});
  } else {
    passing_.push_back({numbers_++, std::move(frame), 0});
  }
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
