#include "localize/search_job.hpp"

#include <sys/resource.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace vantage {
namespace {

/// Calls a function in this thread at a low priority, and leaves at least one core to others.
template <class Function>
auto in_background(const Function& function) {
  // Linux keeps a nice value for each thread; if it cannot be set, the search competes as it is.
  constexpr int kNice = 5;  // a third of the share of others on a busy core
  static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice));
  const auto cores = static_cast<int>(std::thread::hardware_concurrency());
  tbb::task_arena arena(std::max(1, cores - 1), 1, tbb::task_arena::priority::low);
  return arena.execute(function);
}

}  // namespace

double nominal_milliseconds(const SearchWork& work) noexcept {
  constexpr double kAlignedPerMs = 2000.0, kLoadedPerMs = 7000.0;
  return work.search_ms + static_cast<double>(work.aligned) / kAlignedPerMs +
         static_cast<double>(work.loaded) / kLoadedPerMs;
}

SearchJob::SearchJob(Search search, const Options& options)
    : search_(std::move(search)), options_(options) {
  if (options_.live && !options_.budget_ms) options_.budget_ms = kLiveBudget;
}

SearchJob::~SearchJob() { stop_.request_stop(); }

void SearchJob::begin(double stamp, SearchTask task) {
  begun_ = stamp;
  nominal_ms_ = 0.0;
  T_then_now_ = {};
  waiting_ = true;
  stop_ = std::stop_source();
  if (options_.live) {
    running_ =
        std::async(std::launch::async, [this, the_task = std::move(task), stop = stop_.get_token(),
                                        dropped = std::move(running_)] {
          if (dropped.valid()) dropped.wait();
          return in_background([&] { return search_(the_task, stop); });
        });
    return;
  }
  std::promise<Result<SearchAnswer>> promise;
  running_ = promise.get_future();
  auto answer = search_(task, stop_.get_token());
  if (answer) nominal_ms_ = nominal_milliseconds(answer->work);
  promise.set_value(std::move(answer));
}

void SearchJob::move(const Pose& T_before_now) { T_then_now_ = T_then_now_ * T_before_now; }

std::optional<SearchJob::Known> SearchJob::answer(double stamp) {
  if (!waiting_) return {};
  const bool same_scan = stamp == begun_;
  if (options_.live) {
    const std::chrono::duration<double, std::milli> wait(same_scan ? *options_.budget_ms : 0.0);
    if (running_.wait_for(wait) != std::future_status::ready) return {};
  } else if (options_.budget_ms && nominal_ms_ > *options_.budget_ms) {
    // The program of a robot would not have it yet.
    if (stamp < begun_ + nominal_ms_ / 1000.0) return {};
  }
  waiting_ = false;
  return Known{.answer = running_.get(),
               .T_then_now = same_scan ? std::nullopt : std::optional(T_then_now_)};
}

void SearchJob::drop() {
  stop_.request_stop();
  waiting_ = false;
}

}  // namespace vantage
