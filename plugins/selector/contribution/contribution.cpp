#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "vantage/kit/hash.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/pose_error.hpp"

namespace vantage::contribution {
namespace {

/// What is known before the first element: with the usual noise, the pose to 0.14 m and 0.014 rad.
constexpr double kPrior = 5.0;

/// So many elements are compared exactly. Those after them add little.
constexpr std::size_t kExact = 256;

/// Chooses greedily: of some candidates, the element after which the error of the poses is least.
class Choice {
 public:
  Choice(const RegionElements& region, float noise, float power)
      : power_(power), begin_(region.elements.size() + 1, 0) {
    for (const auto& scan : region.scans) {
      for (const Pull& pull : scan) ++begin_[pull.element + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    touches_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t s = 0; s < region.scans.size(); ++s) {
      for (const Pull& pull : region.scans[s]) touches_[next[pull.element]++] = {s, term_of(pull)};
    }
    scans_.assign(region.scans.size(), PoseError(noise, kPrior));
  }

  [[nodiscard]] bool touches(std::uint32_t element) const noexcept {
    return begin_[element] < begin_[element + 1];
  }

  /// By how much the errors grow with an element; negative for a good one.
  [[nodiscard]] float growth_with(std::uint32_t element) const {
    float growth = 0.0F;
    for (std::size_t k = begin_[element]; k < begin_[element + 1]; ++k) {
      const PoseError& scan = scans_[touches_[k].scan];
      const PullTerm& term = touches_[k].term;
      growth += cost(taken_ < kExact ? scan.squared_with(term) : scan.nearly_squared_with(term)) -
                cost(scan.squared());
    }
    return growth;
  }

  void take(std::uint32_t element) {
    ++taken_;
    for (std::size_t k = begin_[element]; k < begin_[element + 1]; ++k) {
      scans_[touches_[k].scan].add(touches_[k].term);
    }
  }

 private:
  struct Touch {
    std::uint32_t scan = 0;
    PullTerm term;
  };
  [[nodiscard]] float cost(float squared) const noexcept {
    if (!(squared < 1e6F)) return 1e6F;
    return power_ == 1.0F ? squared : std::pow(std::max(squared, 0.0F), power_);
  }

  float power_;
  std::size_t taken_ = 0;
  std::vector<std::size_t> begin_;  // of an element's touches
  std::vector<Touch> touches_;
  std::vector<PoseError> scans_;
};

/// Elements that fix the poses of scans, and whose errors cancel.
struct Contribution {
  std::uint32_t candidates = 64;
  double noise = 0.1;  // as PoseError::kNoise
  double power = 1.0;
  std::uint64_t seed = 17;

  static constexpr auto schema() {
    return std::tuple{
        vantage::optional("candidates", &Contribution::candidates, "",
                          "elements that are tried for each that is chosen", vantage::at_least(1)),
        vantage::optional("noise", &Contribution::noise, "",
                          "how much the noise of scans counts beside the bias of elements",
                          vantage::positive),
        vantage::optional("power", &Contribution::power, "", "of the squared error",
                          vantage::positive),
        vantage::optional("seed", &Contribution::seed, "", "another seed tries other candidates"),
    };
  }

  [[nodiscard]] Result<std::vector<std::uint32_t>> order(const RegionElements& region,
                                                         std::size_t most) const {
    Choice choice(region, static_cast<float>(noise), static_cast<float>(power));
    std::vector<std::uint32_t> left, untouched, order;
    for (std::uint32_t i = 0; i < region.elements.size(); ++i) {
      (choice.touches(i) ? left : untouched).push_back(i);
    }
    most = std::min(most, region.elements.size());
    while (order.size() < most && !left.empty()) {
      std::size_t best = 0;
      float least = std::numeric_limits<float>::infinity();
      const std::size_t tries = std::min<std::size_t>(candidates, left.size());
      for (std::size_t k = 0; k < tries; ++k) {
        const std::size_t at = tries == left.size() ? k : hash(seed, order.size(), k) % left.size();
        const float growth = choice.growth_with(left[at]);
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
