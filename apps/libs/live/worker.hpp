#pragma once

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
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

  void run(std::function<void()> job) { run_latest({}, std::move(job)); }
  /// In place of the job of this kind that waits, if there is one: at most one of a kind waits.
  /// @param kind  a literal
  void run_latest(std::string_view kind, std::function<void()> job) {
    {
      const std::scoped_lock lock(mutex_);
      const auto same = kind.empty() ? jobs_.end() : std::ranges::find(jobs_, kind, &Job::kind);
      if (same != jobs_.end()) {
        same->run = std::move(job);
        return;
      }
      jobs_.push_back({kind, std::move(job)});
    }
    changed_.notify_one();
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
