#include "intervals.hpp"

#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/gamma.hpp>

namespace vantage::benchmarks {
namespace {

// Quantiles of the beta distribution: the inverse of the regularized incomplete beta function.

double lower(const Count& count, double tail) {
  if (count.hits == 0) return 0.0;
  const auto hits = static_cast<double>(count.hits);
  return boost::math::ibeta_inv(hits, static_cast<double>(count.of - count.hits) + 1.0, tail);
}

double upper(const Count& count, double tail) {
  if (count.hits == count.of) return 1.0;
  const auto hits = static_cast<double>(count.hits);
  return boost::math::ibetac_inv(hits + 1.0, static_cast<double>(count.of - count.hits), tail);
}

}  // namespace

Interval clopper_pearson(const Count& count, double confidence) {
  const double tail = (1.0 - confidence) / 2.0;
  return {.low = lower(count, tail), .high = upper(count, tail)};
}

double upper_limit(const Count& count, double confidence) { return upper(count, 1.0 - confidence); }

Interval poisson_interval(std::size_t events, double confidence) {
  const double tail = (1.0 - confidence) / 2.0;
  const auto k = static_cast<double>(events);
  return {.low = events == 0 ? 0.0 : boost::math::gamma_p_inv(k, tail),
          .high = boost::math::gamma_q_inv(k + 1.0, tail)};
}

}  // namespace vantage::benchmarks
