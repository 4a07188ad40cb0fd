#pragma once

#include <optional>

#include "localize/evidence.hpp"

namespace vantage {

/// The evidence for a pose that is followed: its odds against "elsewhere", which says that the
/// sensor is at none of the poses that are followed. The odds are those before any scan, times what
/// the scans say. Scans at different places are independent for a pose that is far off, so their
/// logarithms add up. They are not for a lookalike, so its odds are those of the mean of the last
/// scans, however many there were.
class Support {
 public:
  Support() = default;
  /// A pose that was given. @param log_odds  of it, before any scan and search
  Support(double log_odds, const Lookalikes& among) : prior_(log_odds), among_(among) {}
  /// A pose that a search found. @param among  what it was chosen from
  Support(double recall, double missed, const Lookalikes& among);

  /// Takes in a scan.
  /// @param told  log(p(scan | right) / p(scan | far off))
  /// @param news  how independent the scan is of those before, in [0, 1]
  void take(const Evidence& evidence, double told, double news, std::optional<double> usual,
            const ShareModel& model);
  /// The same for a scan whose share says nothing.
  void take(double told, double news);

  /// What another sensor says of where the sensor is, as in `agreement`. Its errors persist, so it
  /// counts once: what it said before is forgotten.
  void see_prior(double log_likelihood_ratio) { absolute_ = log_likelihood_ratio; }
  /// What the last search says of wrong poses around here.
  void be_among(double scale) { among_.scale = scale; }
  /// A search found the pose. If it had been found or refuted before, its odds are at least those
  /// of a find. Otherwise, the sensor is less probably elsewhere; that counts once, as searches
  /// miss the same places.
  /// @param recall, missed  probability that the sensor is at a find, and that it is not
  void be_found(double recall, double missed);
  /// Makes the odds higher or lower, against those of other poses that are followed.
  void favour(double log_odds);
  /// Lowers the odds to these; scans may raise them again.
  void doubt(double log_odds);

  /// @param compared  the pose, with all other places; otherwise one of them may be alike
  [[nodiscard]] double log_odds(bool compared) const;

 private:
  double prior_ = 0.0, absolute_ = 0.0, relative_ = 0.0;
  bool found_ = false;     // the prior is that of a find
  double searched_ = 0.0;  // what the best search adds, if it is not
  double far_ = 0.0;       // log ratio to a pose that is far off
  Lookalikes among_ = Lookalikes::of({});
  Evidence mean_;
  double scans_ = 0.0;                 // in the mean, by their news
  LookalikeOdds lookalike_{0.0, 0.0};  // of the mean
};

}  // namespace vantage
