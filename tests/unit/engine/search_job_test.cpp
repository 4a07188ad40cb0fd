#include "localize/search_job.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <latch>
#include <thread>
#include <utility>

using namespace vantage;

namespace {

/// An answer that takes `ms` of nominal time.
SearchAnswer answer_of(double ms) {
  SearchAnswer answer{.compared = true};
  answer.to_itself.level = 0.7;
  answer.work.search_ms = ms;
  return answer;
}

SearchTask no_task() { return {.scan = {}, .to_itself = {}, .area = {}}; }

/// A search that takes as long as the test wants.
struct SlowSearch {
  std::atomic<bool> begun = false;
  std::latch may_end{1};
  std::atomic<int> ended = 0;
  bool heeds_stop = false;

  SearchJob::Search function() {
    return [this](const SearchTask&, const std::stop_token& stop) -> Result<SearchAnswer> {
      begun = true;
      begun.notify_all();
      if (heeds_stop) {
        while (!stop.stop_requested()) std::this_thread::yield();
      } else {
        may_end.wait();
      }
      ++ended;
      return answer_of(0.0);
    };
  }
};

/// Asks until there is an answer.
SearchJob::Known answer_at_last(SearchJob& job, double stamp) {
  for (;;) {
    if (auto known = job.answer(stamp)) return *std::move(known);
    std::this_thread::yield();
  }
}

Pose along_x(double x) { return pose_from_xyz_rpy({x, 0, 0}, {0, 0, 0}); }

}  // namespace

TEST_CASE("without a budget, a search ends within its scan") {
  SearchJob job([](const auto&, const auto&) { return answer_of(1e6); }, {});
  CHECK_FALSE(job.under_way());
  CHECK_FALSE(job.answer(0.0));
  job.begin(0.0, no_task());
  CHECK(job.under_way());
  const auto known = job.answer(0.0);
  REQUIRE(known);
  CHECK(known->answer->to_itself.level == 0.7);
  CHECK_FALSE(known->T_then_now);
  CHECK_FALSE(job.under_way());
}

TEST_CASE("with a budget, a longer search is known at the scan that is its nominal time later") {
  for (const auto& [ms, known_at] :
       {std::pair{19.0, 0}, {21.0, 1}, {99.0, 1}, {101.0, 2}, {350.0, 4}}) {
    SearchJob job([&, wanted = ms](const auto&, const auto&) { return answer_of(wanted); },
                  {.live = false, .budget_ms = 20.0});
    job.begin(5.0, no_task());
    for (int scan = 0; scan < known_at; ++scan) {
      CHECK_FALSE(job.answer(5.0 + 0.1 * scan));
      CHECK(job.under_way());
      job.move(along_x(0.5));
    }
    const auto known = job.answer(5.0 + 0.1 * known_at);
    REQUIRE(known);
    CHECK(known->T_then_now.has_value() == (known_at > 0));
    if (known_at > 0) {
      CHECK(known->T_then_now->translation.x() == doctest::Approx(0.5 * known_at));
    }
    CHECK_FALSE(job.under_way());
  }
}

TEST_CASE("nominal time grows with each kind of work") {
  const auto ms = [](const SearchWork& work) { return nominal_milliseconds(work); };
  CHECK(ms({}) == 0.0);
  CHECK(ms({.search_ms = 1.0, .aligned = 0, .loaded = 0}) > 0.0);
  CHECK(ms({.search_ms = 0.0, .aligned = 1'000'000, .loaded = 0}) > 0.0);
  CHECK(ms({.search_ms = 0.0, .aligned = 0, .loaded = 1'000'000}) > 0.0);
}

TEST_CASE("a search that fails says so at its scan, also with a budget") {
  SearchJob job(
      [](const auto&, const auto&) -> Result<SearchAnswer> {
        return fail(ErrorCode::corrupt_data, "damaged");
      },
      {.live = false, .budget_ms = 0.0});
  job.begin(0.0, no_task());
  const auto known = job.answer(0.0);
  REQUIRE(known);
  CHECK(known->answer.error().message == "damaged");
}

TEST_CASE("live, a scan returns while its search hangs, and a later scan takes the answer") {
  SlowSearch slow;
  SearchJob job(slow.function(), {.live = true, .budget_ms = 1.0});
  job.begin(0.0, no_task());
  slow.begun.wait(false);
  CHECK_FALSE(job.answer(0.0));
  job.move(along_x(1.0));
  CHECK_FALSE(job.answer(0.1));
  CHECK(job.under_way());
  job.move(along_x(1.0));
  slow.may_end.count_down();
  const auto known = answer_at_last(job, 0.2);
  REQUIRE(known.answer);
  CHECK(known.T_then_now->translation.x() == doctest::Approx(2.0));
  CHECK_FALSE(job.under_way());
}

TEST_CASE("live, a quick search is known at its own scan") {
  SearchJob job([](const auto&, const auto&) { return answer_of(1e6); },
                {.live = true, .budget_ms = 60e3});
  job.begin(0.0, no_task());
  const auto known = job.answer(0.0);
  REQUIRE(known);
  CHECK_FALSE(known->T_then_now);
}

TEST_CASE("live, a dropped search says nothing, and the next begins once it has ended") {
  SlowSearch slow;
  SearchJob job(slow.function(), {.live = true, .budget_ms = 0.0});
  job.begin(0.0, no_task());
  slow.begun.wait(false);
  job.drop();
  CHECK_FALSE(job.under_way());
  CHECK_FALSE(job.answer(0.1));
  job.begin(0.2, no_task());  // does not wait
  CHECK(job.under_way());
  CHECK_FALSE(job.answer(0.2));
  CHECK(slow.ended == 0);
  slow.may_end.count_down();
  CHECK(answer_at_last(job, 0.3).answer);
  CHECK(slow.ended == 2);
}

TEST_CASE("live, several searches are dropped while the first one still ends") {
  SlowSearch slow;
  slow.heeds_stop = true;
  {
    SearchJob job(slow.function(), {.live = true, .budget_ms = 0.0});
    for (int k = 0; k < 5; ++k) {
      job.begin(0.1 * k, no_task());
      job.drop();
    }
  }
  CHECK(slow.ended == 5);
}

TEST_CASE("live, a job that is destroyed ends its search first") {
  SlowSearch slow;
  slow.heeds_stop = true;
  {
    SearchJob job(slow.function(), {.live = true, .budget_ms = 0.0});
    job.begin(0.0, no_task());
    slow.begun.wait(false);
  }
  CHECK(slow.ended == 1);
}

TEST_CASE("live, many searches one after the other") {
  std::atomic<int> searches = 0;
  SearchJob job(
      [&](const SearchTask& task, const auto&) {
        ++searches;
        return answer_of(static_cast<double>(task.scan.dropped));
      },
      {.live = true, .budget_ms = 0.0});
  for (int k = 0; k < 200; ++k) {
    SearchTask task = no_task();
    task.scan.dropped = static_cast<std::size_t>(k);
    job.begin(k, std::move(task));
    CHECK(answer_at_last(job, k + 0.5).answer->work.search_ms == answer_of(k).work.search_ms);
  }
  CHECK(searches == 200);
}
