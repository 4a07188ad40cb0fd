#include "localize/belief.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vantage {
namespace {

// However clear the evidence: a belief that reached 0 could never recover.
constexpr double kLeastLog = -60.0;

double log_sum(double a, double b) {
  const double most = std::max(a, b);
  return most + std::log(std::exp(a - most) + std::exp(b - most));
}

}  // namespace

Belief Belief::in_one(double probability) {
  Belief belief;
  belief.logs_ = {std::log(probability)};
  belief.elsewhere_ = std::log1p(-probability);
  return belief;
}

double Belief::of(std::size_t hypothesis) const { return std::exp(logs_[hypothesis]); }
double Belief::elsewhere() const { return std::exp(elsewhere_); }

void Belief::weigh(const std::vector<double>& log_likelihood_ratios) {
  for (std::size_t h = 0; h < logs_.size(); ++h) logs_[h] += log_likelihood_ratios[h];
  normalize();
}

void Belief::forget(double share) {
  for (double& log : logs_) {
    elsewhere_ = log_sum(elsewhere_, log + std::log(share));
    log += std::log1p(-share);
  }
  normalize();
}

void Belief::add(double log_odds) {
  logs_.push_back(elsewhere_ + log_odds);
  normalize();
}

void Belief::keep(const std::vector<std::vector<std::size_t>>& groups) {
  std::vector<double> kept;
  std::vector<bool> taken(logs_.size(), false);
  for (const auto& group : groups) {
    double sum = logs_[group.front()];
    for (std::size_t k = 1; k < group.size(); ++k) sum = log_sum(sum, logs_[group[k]]);
    for (const std::size_t h : group) taken[h] = true;
    kept.push_back(sum);
  }
  for (std::size_t h = 0; h < logs_.size(); ++h) {
    if (!taken[h]) elsewhere_ = log_sum(elsewhere_, logs_[h]);
  }
  logs_ = std::move(kept);
  normalize();
}

void Belief::normalize() {
  double total = elsewhere_;
  for (const double log : logs_) total = log_sum(total, log);
  elsewhere_ = std::max(kLeastLog, elsewhere_ - total);
  for (double& log : logs_) log = std::max(kLeastLog, log - total);
}

}  // namespace vantage
