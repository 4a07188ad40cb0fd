#pragma once

#include <algorithm>
#include <optional>

#include "localize/contrast.hpp"
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
  /// @param log_odds  of the pose, before any scan and search
  /// @param among     what it was chosen from
  explicit Support(double log_odds, const Lookalikes& among = {})
      : prior_(log_odds), among_(among) {}

  /// Takes in what a scan says against poses that are far off.
  /// @param told  log(p(scan | right) / p(scan | far off))
  /// @param news  how independent the scan is of those before, in [0, 1]
  void take(double told, double news);
  /// Takes in what its share and margin say against lookalikes.
  void take(const Evidence& evidence, double news);
  /// Takes in the contrast at another place.
  void take(const Contrast& contrast);

  /// What other sensors say of where the sensor is, as in `agreement`. Their errors persist, so
  /// they count once: what they said before is forgotten.
  void see_prior(double log_likelihood_ratio) { absolute_ = log_likelihood_ratio; }
  /// What the last search says of wrong poses around here.
  void be_among(double scale) { among_.scale = scale; }
  /// A search found the pose. Then the sensor is less probably elsewhere, never more; that counts
  /// once, because searches miss the same places.
  /// @param missed  the odds that the sensor is at no find (Recovery::learn)
  void be_found(double missed);
  /// Makes the odds higher or lower, against those of other poses that are followed.
  void favour(double log_odds);
  /// No other pose is followed any more: the odds that this one left to others are its own again.
  void be_alone() { relative_ = std::max(0.0, relative_); }
  /// Lowers the odds to these; scans may raise them again.
  void doubt(double log_odds);
  /// The scans and searches before were at another place, maybe.
  void start_anew();

  [[nodiscard]] double log_odds() const;
  /// The odds that the sensor is beside the pose, beyond the alert limit, against being there.
  /// They are no part of `log_odds`: no search looks there, and nothing else speaks for it.
  [[nodiscard]] double odds_near() const;
  /// Whether the contrasts speak for another place beside the pose.
  [[nodiscard]] bool shows_twin() const { return ratio_of_contrasts() > 1.0; }

 private:
  [[nodiscard]] double ratio_of_contrasts() const;
  [[nodiscard]] double log_prior() const { return prior_ + absolute_ + relative_ + searched_; }

  double prior_ = 0.0, absolute_ = 0.0, relative_ = 0.0;
  double searched_ = 0.0;  // what the best search adds
  double far_ = 0.0;       // log ratio to a pose that is far off
  Lookalikes among_;
  Evidence mean_;
  double scans_ = 0.0;                 // in the mean, by their news
  LookalikeOdds lookalike_{0.0, 0.0};  // of the mean
  std::optional<Contrast> contrast_;   // the mean of the last ones
  double contrasts_ = 0.0;             // in the mean, by their precision
};

}  // namespace vantage
