#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <limits>
#include <mutex>
#include <ranges>
#include <string_view>
#include <thread>
#include <utility>

namespace vantage::live {

/// Runs jobs one after the other in a thread, so that a scan waits for no disk.
class Worker {
 public:
  Worker() : thread_([this] { work(); }) {}
  ~Worker() { stop(); }
  /// Runs what waits, and ends: what comes later is not run.
  void stop() {
    if (!thread_.joinable()) return;
    {
      const std::scoped_lock lock(mutex_);
      ends_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Waits until all that waits has been run.
  void finish() {
    std::promise<void> done;
    run([&done] { done.set_value(); });
    done.get_future().wait();
  }

  void run(std::function<void()> job) {
    constexpr auto kAny = std::numeric_limits<std::size_t>::max();
    static_cast<void>(run_latest({}, std::move(job), kAny));
  }
  /// At most so many jobs of a kind wait: the oldest of them is left out for this one, and those
  /// between move up.
  /// @param kind  a literal
  /// @return      how many jobs are left out: 0 or 1
  std::size_t run_latest(std::string_view kind, std::function<void()> job, std::size_t most = 1) {
    std::size_t left_out = 0;
    {
      const std::scoped_lock lock(mutex_);
      const auto is_same = [&](const Job& one) { return one.kind == kind; };
      if (static_cast<std::size_t>(std::ranges::count_if(jobs_, is_same)) < most) {
        jobs_.push_back({kind, std::move(job)});
      } else {
        left_out = 1;
        for (Job& one : jobs_ | std::views::reverse | std::views::filter(is_same)) {
          std::swap(one.run, job);
        }
      }
    }
    changed_.notify_one();
    return left_out;
  }

 private:
  struct Job {
    std::string_view kind;
    std::function<void()> run;
  };

  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return ends_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      const Job job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      job.run();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool ends_ = false;
  std::thread thread_;  // last: works with what is above
};

}  // namespace vantage::live
