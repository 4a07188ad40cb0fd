#pragma once

#include <cstddef>
#include <vector>

namespace vantage {

/// The probability of each of several hypotheses about a sensor's pose, and the probability that
/// the sensor is elsewhere: at none of them. The probabilities always add up to 1.
class Belief {
 public:
  /// No hypothesis: the sensor is elsewhere.
  Belief() = default;
  /// One hypothesis, which is right with this probability.
  [[nodiscard]] static Belief in_one(double probability);

  [[nodiscard]] std::size_t size() const noexcept { return logs_.size(); }
  [[nodiscard]] double of(std::size_t hypothesis) const;
  [[nodiscard]] double elsewhere() const;

  /// Updates the belief with a scan.
  /// @param log_likelihood_ratios  log(p(scan | right) / p(scan | wrong)) of each hypothesis
  void weigh(const std::vector<double>& log_likelihood_ratios);
  /// Takes in what another sensor says of where the sensor is. Its errors persist, so it counts
  /// once: what it said before is forgotten.
  /// @param log_likelihood_ratios  log(p(prior | right) / p(prior | elsewhere)) of each hypothesis
  void see_prior(std::vector<double> log_likelihood_ratios);
  /// Moves this share of the belief in each hypothesis to elsewhere: the sensor may have been
  /// carried away.
  void forget(double share);
  /// Adds a hypothesis.
  /// @param log_odds  log(p(hypothesis) / p(elsewhere)), without a prior
  /// @param prior     its log likelihood ratio, as in see_prior
  void add(double log_odds, double prior);
  /// Adds a hypothesis beside another one that may be meant by it.
  /// @param log_odds  log(p(hypothesis) / p(the other one))
  void add_beside(std::size_t other, double log_odds);
  /// Merges the hypotheses of each group into one, in the order of the groups. The belief in a
  /// hypothesis that is in no group moves to elsewhere.
  void keep(const std::vector<std::vector<std::size_t>>& groups);

 private:
  void normalize();

  std::vector<double> logs_;    // without the prior
  std::vector<double> priors_;  // of each: its log likelihood ratio
  double elsewhere_ = 0.0;      // logarithm
};

}  // namespace vantage
