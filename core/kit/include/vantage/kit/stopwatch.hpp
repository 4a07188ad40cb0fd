#pragma once

#include <ctime>

#include <chrono>

namespace vantage {

/// Wall clock since its construction.
class Stopwatch {
 public:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(Clock::now() - start_).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// Adds the wall clock of its scope to a sum [s].
class ScopeTimer {
 public:
  explicit ScopeTimer(double& seconds) noexcept : seconds_(seconds) {}
  ~ScopeTimer() { seconds_ += stopwatch_.seconds(); }
  ScopeTimer(const ScopeTimer&) = delete;
  ScopeTimer& operator=(const ScopeTimer&) = delete;

 private:
  double& seconds_;
  Stopwatch stopwatch_;
};

/// Processor time since its construction.
template <clockid_t kClock>
class ProcessorStopwatch {
 public:
  [[nodiscard]] double seconds() const { return now() - start_; }

 private:
  static double now() {
    timespec time{};
    ::clock_gettime(kClock, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  double start_ = now();
};
/// Of all threads of the process.
using CpuStopwatch = ProcessorStopwatch<CLOCK_PROCESS_CPUTIME_ID>;
/// Of the thread that asks.
using ThreadStopwatch = ProcessorStopwatch<CLOCK_THREAD_CPUTIME_ID>;

}  // namespace vantage
