#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <tuple>
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
  /// An element that touches scans, drawn in proportion to how many it touches.
  [[nodiscard]] std::uint32_t drawn(std::uint64_t number) const noexcept {
    const auto touch = static_cast<std::size_t>(number % touches_.size());
    const auto after = std::ranges::upper_bound(begin_, touch);
    return static_cast<std::uint32_t>(after - begin_.begin() - 1);
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

/// Numbers from 0 on, of which some are taken out.
class Left {
 public:
  /// @param numbers  ascending
  explicit Left(std::vector<std::uint32_t> numbers)
      : numbers_(std::move(numbers)), at_(numbers_.empty() ? 0 : numbers_.back() + 1, kGone) {
    for (std::uint32_t k = 0; k < numbers_.size(); ++k) at_[numbers_[k]] = k;
  }
  [[nodiscard]] std::size_t size() const noexcept { return numbers_.size(); }
  [[nodiscard]] std::uint32_t operator[](std::size_t k) const noexcept { return numbers_[k]; }
  [[nodiscard]] bool has(std::uint32_t number) const noexcept { return at_[number] != kGone; }
  void take(std::uint32_t number) noexcept {
    const std::uint32_t k = at_[number], last = numbers_.back();
    numbers_[k] = last;
    at_[last] = k;
    at_[number] = kGone;
    numbers_.pop_back();
  }

 private:
  static constexpr std::uint32_t kGone = ~std::uint32_t{0};
  std::vector<std::uint32_t> numbers_, at_;
};

/// Elements that fix the poses of scans, and whose errors cancel.
struct Contribution {
  std::uint32_t candidates = 64;
  double noise = 0.1;  // as PoseError::kNoise
  double power = 0.5;
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
    std::vector<std::uint32_t> touching, untouched, order;
    for (std::uint32_t i = 0; i < region.elements.size(); ++i) {
      (choice.touches(i) ? touching : untouched).push_back(i);
    }
    most = std::min(most, region.elements.size());
    Left left(std::move(touching));
    const auto candidate = [&](std::size_t k) {
      if (left.size() <= candidates) return left[k];
      const std::uint64_t number = hash(seed, order.size(), k);
      // Few elements hold the pose everywhere only if each is seen from many places.
      const std::uint32_t one = choice.drawn(number);
      return left.has(one) ? one : left[number % left.size()];
    };
    while (order.size() < most && left.size() > 0) {
      std::uint32_t best = left[0];
      float least = std::numeric_limits<float>::infinity();
      for (std::size_t k = 0; k < std::min<std::size_t>(candidates, left.size()); ++k) {
        const std::uint32_t one = candidate(k);
        const float growth = choice.growth_with(one);
        if (growth >= least) continue;
        least = growth;
        best = one;
      }
      choice.take(best);
      order.push_back(best);
      left.take(best);
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
