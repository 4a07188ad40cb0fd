#include <algorithm>
#include <cstdint>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

#include "pose_error.hpp"
#include "vantage/kit/hash.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace vantage::contribution {
namespace {

/// What is known before the first element: the pose to 1 m and 0.1 rad, by a weak prior.
constexpr double kPrior = 5.0;

/// Chooses greedily: of some candidates, the element after which the error of the poses is least.
class Choice {
 public:
  Choice(const RegionElements& region, double noise, double power)
      : noise_(noise), power_(power), begin_(region.elements.size() + 1, 0) {
    for (const auto& scan : region.scans) {
      for (const Pull& pull : scan) ++begin_[pull.element + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    touches_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t s = 0; s < region.scans.size(); ++s) {
      for (const Pull& pull : region.scans[s]) touches_[next[pull.element]++] = {s, sum_of(pull)};
    }
    Sum prior;
    for (std::size_t row = 0, k = 0; row < 6; k += 6 - row, ++row) prior.hessian[k] = kPrior;
    scans_.assign(region.scans.size(), {prior, cost(squared_error(prior, noise_))});
  }

  [[nodiscard]] bool touches(std::uint32_t element) const noexcept {
    return begin_[element] < begin_[element + 1];
  }

  /// By how much the errors grow with an element; negative for a good one.
  [[nodiscard]] double growth_with(std::uint32_t element) const noexcept {
    double growth = 0.0;
    for (std::size_t k = begin_[element]; k < begin_[element + 1]; ++k) {
      const ScanState& scan = scans_[touches_[k].scan];
      growth += cost(squared_error(scan.sum + touches_[k].sum, noise_)) - scan.cost;
    }
    return growth;
  }

  void take(std::uint32_t element) {
    for (std::size_t k = begin_[element]; k < begin_[element + 1]; ++k) {
      ScanState& scan = scans_[touches_[k].scan];
      scan.sum = scan.sum + touches_[k].sum;
      scan.cost = cost(squared_error(scan.sum, noise_));
    }
  }

 private:
  struct Touch {
    std::uint32_t scan = 0;
    Sum sum;
  };
  struct ScanState {
    Sum sum;
    double cost = 0.0;
  };
  [[nodiscard]] double cost(double squared) const noexcept {
    return std::isfinite(squared) ? std::pow(squared, power_) : 1e6;
  }

  double noise_, power_;
  std::vector<std::size_t> begin_;  // of an element's touches
  std::vector<Touch> touches_;
  std::vector<ScanState> scans_;
};

/// Elements that fix the poses of scans, and whose errors cancel.
struct Contribution {
  std::uint32_t candidates = 64;
  double noise = 0.1;
  double power = 1.0;

  static constexpr auto schema() {
    return std::tuple{
        vantage::optional("candidates", &Contribution::candidates, "",
                          "elements that are tried for each that is chosen", vantage::at_least(1)),
        vantage::optional("noise", &Contribution::noise, "",
                          "how much the noise of scans counts beside the bias of elements",
                          vantage::positive),
        vantage::optional("power", &Contribution::power, "", "of the squared error",
                          vantage::positive),
    };
  }

  [[nodiscard]] Result<std::vector<std::uint32_t>> order(const RegionElements& region,
                                                         std::size_t most) const {
    Choice choice(region, noise, power);
    std::vector<std::uint32_t> left, untouched, order;
    for (std::uint32_t i = 0; i < region.elements.size(); ++i) {
      (choice.touches(i) ? left : untouched).push_back(i);
    }
    most = std::min(most, region.elements.size());
    while (order.size() < most && !left.empty()) {
      std::size_t best = 0;
      double least = std::numeric_limits<double>::infinity();
      const std::size_t tries = std::min<std::size_t>(candidates, left.size());
      for (std::size_t k = 0; k < tries; ++k) {
        const std::size_t at = tries == left.size() ? k : hash(17, order.size(), k) % left.size();
        const double growth = choice.growth_with(left[at]);
        if (growth >= least) continue;
        least = growth;
        best = at;
      }
      choice.take(left[best]);
      order.push_back(left[best]);
      left[best] = left.back();
      left.pop_back();
    }
    // No scan touches these: the fullest first.
    std::ranges::stable_sort(untouched, std::greater(),
                             [&](std::uint32_t i) { return region.elements[i].points; });
    for (std::size_t k = 0; order.size() < most; ++k) order.push_back(untouched[k]);
    return order;
  }
};

}  // namespace
}  // namespace vantage::contribution

VANTAGE_PLUGIN(vantage::Selector, vantage::SelectorOf<vantage::contribution::Contribution>,
               "contribution", "elements that fix the pose of a scan and whose errors cancel");
