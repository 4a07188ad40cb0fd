#pragma once

#include <functional>
#include <future>
#include <optional>
#include <stop_token>

#include "localize/pose_search.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// How long a search takes on one core of the machine of docs/measurements/README.md, by its work:
/// a millisecond of the relocalizer, 2,000 aligned or 7,000 loaded points. The same on any machine.
[[nodiscard]] double nominal_milliseconds(const SearchWork& work) noexcept;

/// Decides when a search takes place, and at which scan its answer is known: at most one search is
/// under way. There are three ways:
/// - Without a budget, a search is finished within its scan.
/// - With a budget, the answer of a search that takes longer by its nominal time is known at the
///   first scan whose stamp is that much later. The search itself runs at once, so that a recording
///   gives the same result on any machine.
/// - Live, the search runs in a thread of its own. The scan that it was begun for waits for it, at
///   most for the budget; later scans only look whether it has finished, because they have to align
///   what was found.
/// Not thread safe: begin, answer and drop are called by one thread.
class SearchJob {
 public:
  using Search = std::function<Result<SearchAnswer>(const SearchTask&, const std::stop_token&)>;
  struct Options {
    bool live = false;
    std::optional<double> budget_ms;  ///< live, kLiveBudget if left out
  };
  static constexpr double kLiveBudget = 20.0;

  /// @param search  live, it runs in another thread, one at a time
  SearchJob(Search search, const Options& options);
  SearchJob(const SearchJob&) = delete;
  SearchJob& operator=(const SearchJob&) = delete;
  /// Ends a search that is under way, and waits until it has ended.
  ~SearchJob();

  /// Whether a search was begun whose answer is not known yet.
  [[nodiscard]] bool under_way() const noexcept { return waiting_; }
  /// Begins a search for the scan with this stamp. Live, it waits in its thread until a dropped one
  /// has ended. Precondition: none is under way.
  void begin(double stamp, SearchTask task);
  /// Tells the search under way how the sensor moved since the scan before.
  void move(const Pose& T_before_now);

  struct Known {
    Result<SearchAnswer> answer;
    std::optional<Pose> T_then_now;  ///< since the scan of the search, if that is an earlier one
  };
  /// The answer of the search under way, once it is known at the scan with this stamp; then no
  /// search is under way any more.
  [[nodiscard]] std::optional<Known> answer(double stamp);
  /// Forgets the search under way, because what it was begun for is no longer true.
  void drop();

 private:
  Search search_;
  Options options_;
  double begun_ = 0.0;       // stamp of the search
  double nominal_ms_ = 0.0;  // of an answer that is there already
  Pose T_then_now_;
  bool waiting_ = false;  // somebody wants the answer
  std::stop_source stop_;
  std::future<Result<SearchAnswer>> running_;  // last: its end is waited for
};

}  // namespace vantage
