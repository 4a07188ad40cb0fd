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
  belief.priors_ = {0.0};
  belief.elsewhere_ = std::log1p(-probability);
  return belief;
}

double Belief::of(std::size_t hypothesis) const {
  return std::exp(logs_[hypothesis] + priors_[hypothesis]);
}
double Belief::elsewhere() const { return std::exp(elsewhere_); }

void Belief::weigh(const std::vector<double>& log_likelihood_ratios) {
  for (std::size_t h = 0; h < logs_.size(); ++h) logs_[h] += log_likelihood_ratios[h];
  normalize();
}

void Belief::see_prior(std::vector<double> log_likelihood_ratios) {
  priors_ = std::move(log_likelihood_ratios);
  normalize();
}

void Belief::forget(double share) {
  for (std::size_t h = 0; h < logs_.size(); ++h) {
    elsewhere_ = log_sum(elsewhere_, logs_[h] + priors_[h] + std::log(share));
    logs_[h] += std::log1p(-share);
  }
  normalize();
}

void Belief::add(double log_odds, double prior) {
  logs_.push_back(elsewhere_ + log_odds);
  priors_.push_back(prior);
  normalize();
}

void Belief::add_beside(std::size_t other, double log_odds) {
  logs_.push_back(logs_[other] + log_odds);
  priors_.push_back(priors_[other]);
  normalize();
}

void Belief::keep(const std::vector<std::vector<std::size_t>>& groups) {
  std::vector<double> kept, priors;
  std::vector<bool> taken(logs_.size(), false);
  for (const auto& group : groups) {
    double sum = logs_[group.front()];
    for (std::size_t k = 1; k < group.size(); ++k) sum = log_sum(sum, logs_[group[k]]);
    for (const std::size_t h : group) taken[h] = true;
    kept.push_back(sum);
    priors.push_back(priors_[group.front()]);
  }
  for (std::size_t h = 0; h < logs_.size(); ++h) {
    if (!taken[h]) elsewhere_ = log_sum(elsewhere_, logs_[h] + priors_[h]);
  }
  logs_ = std::move(kept);
  priors_ = std::move(priors);
  normalize();
}

void Belief::normalize() {
  double total = elsewhere_;
  for (std::size_t h = 0; h < logs_.size(); ++h) total = log_sum(total, logs_[h] + priors_[h]);
  elsewhere_ = std::max(kLeastLog, elsewhere_ - total);
  for (double& log : logs_) log = std::max(kLeastLog, log - total);
}

}  // namespace vantage
