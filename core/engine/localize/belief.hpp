#pragma once

#include <cstddef>
#include <vector>

namespace vantage {

/// Probabilities of several hypotheses about where a sensor is, and of none of them being right.
/// They always add up to 1.
class Belief {
 public:
  /// Nothing is known.
  Belief() = default;
  /// One hypothesis, which is right with this probability.
  [[nodiscard]] static Belief in_one(double probability);

  [[nodiscard]] std::size_t size() const noexcept { return logs_.size(); }
  [[nodiscard]] double of(std::size_t hypothesis) const;
  [[nodiscard]] double elsewhere() const;

  /// Takes in what a scan says: log(p(scan | right) / p(scan | wrong)) for each hypothesis.
  void weigh(const std::vector<double>& log_likelihood_ratios);
  /// A part of the belief in each hypothesis goes elsewhere: the sensor may have been carried away.
  void forget(double share);
  /// Adds a hypothesis with these odds against elsewhere.
  void add(double log_odds);
  /// Makes one hypothesis of each group of these numbers, in this order. What was believed of the
  /// others goes elsewhere.
  void keep(const std::vector<std::vector<std::size_t>>& groups);

 private:
  void normalize();

  std::vector<double> logs_;
  double elsewhere_ = 0.0;  // logarithm
};

}  // namespace vantage
