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
  double metres = 0.0, degrees = 0.0;  ///< the error of the pose; no meaning without a pose
  std::optional<double> nvtl = {}, coverage = {};
  double seconds_align = 0.0, seconds_search = 0.0, seconds_verdict = 0.0;
  std::string reason = {};
  bool misled = false;  ///< the first scan after a kidnap or a wrong start

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
  bool ambiguous = false;  ///< the world has places that look alike
  std::vector<JudgedScan> scans = {};
};

/// What is counted over runs.
struct Verdict {
  std::size_t scans = 0;
  Count wrong_of_tracked, lost_of_right, uncertain;
  std::size_t finds = 0, wrong_finds = 0;  ///< first tracked scans after others; wrong ones
  /// For each kidnap and wrong start, the scans before the first that is tracked and right;
  /// infinite if there is none.
  std::vector<double> found_after;
  double seconds_align = 0.0;  ///< the sum
  std::size_t aligned = 0;     ///< scans that were aligned

  void add(const JudgedRun& run);
};

/// How a sensor that was misled is found again, and what it costs.
struct Recovery {
  static constexpr std::size_t kSoon = 5;  ///< scans

  Count soon;                   ///< kidnaps and wrong starts found by one of the first kSoon scans
  std::size_t misleading = 0;   ///< of these, those with a scan that is tracked and wrong before
  std::size_t wrong_scans = 0;  ///< such scans
  /// Verdict and search [ms]: of the scans until the sensor is found, and of all others.
  std::vector<double> until_found, otherwise;

  void add(const JudgedRun& run);
};

/// What a stated risk is worth: the scans whose risk is `risk` or less.
struct Calibration {
  double risk = 0.0;
  Count wrong;
  std::size_t stretches = 0;  ///< of consecutive wrong ones; they are not independent
  double stated = 0.0;        ///< mean of the stated risks
};
[[nodiscard]] Calibration calibration(const std::vector<const JudgedRun*>& runs, double risk);

/// Whether the scans show that a risk was not understated.
enum class Kept : std::uint8_t {
  yes,       ///< the upper limit of the share is not above the risk
  no,        ///< the lower limit is above the risk
  undecided  ///< there are too few scans
};
[[nodiscard]] Kept kept(const Calibration& calibration);

/// Markdown tables of everything, on stdout.
void print(const std::vector<JudgedRun>& runs);

/// All scans, one object each, with its world, seed, matcher, map and scenario.
[[nodiscard]] std::string to_json(const std::vector<JudgedRun>& runs);

}  // namespace vantage::benchmarks
