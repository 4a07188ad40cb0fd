#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "intervals.hpp"
#include "vantage/engine/localizer.hpp"

namespace vantage::benchmarks {

/// A pose farther off than this is wrong.
inline constexpr double kAlertMetres = 0.5, kAlertDegrees = 3.0;

/// What the localizer said about one scan, and what is true.
struct JudgedScan {
  double stamp = 0.0;  ///< [s]
  Tracking tracking = Tracking::lost;
  double risk = 1.0;
  bool has_pose = false;
  /// The error of the pose, infinite if no pose is right; no meaning without a pose.
  double metres = 0.0, degrees = 0.0;
  std::optional<double> nvtl = {}, coverage = {};
  double seconds_align = 0.0, seconds_search = 0.0;
  std::string reason = {};
  bool misled = false;  ///< the first scan after a kidnap or a wrong start
  double driven = 0.0;  ///< since the scan before [m]

  [[nodiscard]] bool is_right() const noexcept {
    return has_pose && metres <= kAlertMetres && degrees <= kAlertDegrees;
  }
};

/// One localizer, from one start on.
struct JudgedRun {
  std::string world;
  std::uint64_t seed = 0;
  std::string matcher, map, scenario = {};
  std::size_t part = 0;    ///< which of several starts
  bool ambiguous = false;  ///< `uncertain` is a right answer
  std::vector<JudgedScan> scans = {};
};

/// What is counted over runs.
struct Verdict {
  std::size_t scans = 0;
  double kilometres = 0.0;  ///< that were localized; each run counts its own
  Count wrong_of_tracked, lost_of_right;
  Count uncertain, uncertain_if_clear;     ///< of all scans, and of those in runs not `ambiguous`
  std::size_t stretches = 0;               ///< of consecutive scans that are tracked and wrong
  double farthest = 0.0;                   ///< of the poses that are tracked and wrong [m]
  double least_risk = 1.0;                 ///< that was stated of one of them
  std::size_t finds = 0, wrong_finds = 0;  ///< first tracked scans after others; wrong ones
  /// For each kidnap and wrong start, the scans before the first that is tracked and right;
  /// infinite if there is none.
  std::vector<double> found_after;
  double seconds_align = 0.0;  ///< the sum
  std::size_t aligned = 0;     ///< scans that were aligned

  void add(const JudgedRun& run);
};

[[nodiscard]] Verdict verdict_of(const std::vector<const JudgedRun*>& runs);

/// The runs that a function takes.
template <class Take>
[[nodiscard]] std::vector<const JudgedRun*> those(const std::vector<JudgedRun>& runs, Take take) {
  std::vector<const JudgedRun*> chosen;
  for (const JudgedRun& run : runs) {
    if (take(run)) chosen.push_back(&run);
  }
  return chosen;
}
/// What runs have under a key, in the order of their first appearance.
[[nodiscard]] std::vector<std::string> in_order(const std::vector<JudgedRun>& runs,
                                                std::string JudgedRun::*key);

/// What a stated risk is worth: the scans whose risk is `risk` or less.
struct Calibration {
  double risk = 0.0;
  Count wrong;
  /// The same by stretch: consecutive wrong scans, which are not independent, are one event.
  Count wrong_by_stretch;
  double stated = 0.0;  ///< mean of the stated risks
};
[[nodiscard]] Calibration calibration(const std::vector<const JudgedRun*>& runs, double risk);

/// Whether the scans show that a risk was not understated.
enum class Kept : std::uint8_t {
  yes,       ///< the upper limit of the share is not above the risk
  no,        ///< the lower limit is above the risk
  undecided  ///< there are too few scans
};
[[nodiscard]] Kept kept(const Count& wrong, double risk);

/// What the verdict must keep, and what was counted.
struct Goal {
  std::string name, what;
  double value = 0.0;
  Interval interval;  ///< exact, 95 %
  double limit = 0.0;

  [[nodiscard]] bool is_met() const noexcept { return value <= limit; }
};
/// Wrong of the tracked, stretches a kilometre, lost of the right, and uncertain where a place is
/// not ambiguous.
[[nodiscard]] std::vector<Goal> goals(const Verdict& verdict);

/// Markdown tables of everything, on stdout.
void print(const std::vector<JudgedRun>& runs);

/// Goals in total and by world; and all scans, one object each, with its world, seed, matcher, map
/// and scenario.
[[nodiscard]] std::string to_json(const std::vector<JudgedRun>& runs);

}  // namespace vantage::benchmarks
