#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <utility>
#include <vector>

#include "live/clock.hpp"
#include "live/received.hpp"

namespace vantage::live {

/// Hands messages from the threads that receive them to the one that localizes. One scan waits at
/// most: a later one takes its place.
class Inbox {
 public:
  void put(Received&& received) {
    {
      const std::scoped_lock lock(mutex_);
      const bool is_scan = received.input == Input::points;
      std::size_t& waiting = is_scan ? scans_ : others_;
      if (waiting == (is_scan ? 1 : kMostOthers)) {
        for (auto one = messages_.begin(); one != messages_.end(); ++one) {
          if ((one->input == Input::points) != is_scan) continue;
          messages_.erase(one);
          break;
        }
        ++(is_scan ? dropped_.scans : dropped_.others);
        --waiting;
      }
      ++waiting;
      messages_.push_back(std::move(received));
    }
    changed_.notify_one();
  }

  /// All that came, in its order, and until when it is all. What comes while it is worked through
  /// waits here, and is not missing.
  struct Taken {
    std::deque<Received> messages;
    std::int64_t until = 0;  ///< as Received::arrival [ns]
  };
  /// Waits until something comes.
  [[nodiscard]] Taken take(std::chrono::nanoseconds longest) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, longest, [this] { return !messages_.empty(); });
    scans_ = others_ = 0;
    return {.messages = std::exchange(messages_, {}), .until = now()};
  }

  struct Dropped {
    std::uint64_t scans = 0, others = 0;
  };
  /// Since the last call.
  [[nodiscard]] Dropped take_dropped() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(dropped_, {});
  }

 private:
  static constexpr std::size_t kMostOthers = 20'000;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Received> messages_;
  std::size_t scans_ = 0, others_ = 0;
  Dropped dropped_;
};

}  // namespace vantage::live
