#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "vantage/kit/hash.hpp"
#include "vantage/kit/lanes.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/pull_term.hpp"

namespace vantage::contribution {
namespace {

/// What is known before the first element: with the usual noise, the pose to 0.14 m and 0.014 rad.
constexpr float kPrior = 5.0F;

using lanes::Floats;
using lanes::kLanes;

/// Sums of gradients and Hessians, in the order of a Pull: of some elements and one scan.
struct Sums {
  static constexpr std::size_t kGradient = 6, kAll = kGradient + Pull::kUpper;
  static constexpr std::size_t kQuarters = (kAll + kLanes - 1) / kLanes;
  std::array<Floats, kQuarters> quarters;  // the last lane counts for nothing

  static Sums of(const Pull& pull) {
    const PullTerm term = term_of(pull);
    Sums sums = zero();
    std::size_t k = 0;
    for (Eigen::Index row = 0; row < 6; ++row) sums.set(k++, term.gradient[row]);
    for (Eigen::Index row = 0; row < 6; ++row) {
      for (Eigen::Index column = row; column < 6; ++column) {
        sums.set(k++, term.hessian(row, column));
      }
    }
    return sums;
  }
  static Sums prior() {
    Sums sums = zero();
    std::size_t k = kGradient;
    for (std::size_t row = 0; row < 6; ++row) {
      sums.set(k, kPrior);
      k += 6 - row;
    }
    return sums;
  }
  [[nodiscard]] Sums with(const Sums& others) const {
    Sums sums;
    for (std::size_t k = 0; k < kQuarters; ++k) {
      sums.quarters[k] = quarters[k] + others.quarters[k];
    }
    return sums;
  }

 private:
  static Sums zero() {
    Sums sums;
    sums.quarters.fill(Floats{});
    return sums;
  }
  void set(std::size_t k, float x) { quarters[k / kLanes][k % kLanes] = x; }
};

/// The expected squared errors of four poses: the squared bias, and `noise` times the trace of the
/// covariance.
Floats squared_errors(const std::array<Sums, kLanes>& poses, float noise) {
  using lanes::unrolled;
  // In each of these, a lane is a pose.
  std::array<Floats, kLanes * Sums::kQuarters> sums;
  unrolled<Sums::kQuarters>([&](auto k) {
    std::array<Floats, kLanes> quarter;
    unrolled<kLanes>([&](auto pose) { quarter[pose] = poses[pose].quarters[k]; });
    unrolled<kLanes>([&](std::size_t i) {
      sums[kLanes * k + i] = Floats{quarter[0][i], quarter[1][i], quarter[2][i], quarter[3][i]};
    });
  });
  // H = L L^T and N = L^-1; both are lower triangles.
  Floats L[6][6], N[6][6];
  lanes::Ints sound = ~lanes::Ints{};
  std::size_t next = Sums::kGradient;
  unrolled<6>([&](auto column) {
    unrolled<6 - column>([&](auto below) {
      constexpr std::size_t row = column + below;
      Floats x = sums[next++];
      unrolled<column>([&](auto i) { x -= L[row][i] * L[column][i]; });
      if constexpr (row > column) {
        L[row][column] = x * N[column][column];
      } else {
        sound &= x > 0.0F;
        N[row][row] = lanes::inverse_root<3>(lanes::where(x > 0.0F, x, lanes::floats(1.0F)));
      }
    });
  });
  Floats squared{}, half[6], bias[6]{};
  unrolled<6>([&](auto row) {
    half[row] = N[row][row] * sums[row];
    squared += N[row][row] * N[row][row];
    unrolled<row>([&](auto column) {
      Floats x = L[row][column] * N[column][column];
      unrolled<row - column - 1>(
          [&](auto i) { x += L[row][column + 1 + i] * N[column + 1 + i][column]; });
      N[row][column] = -x * N[row][row];
      half[row] += N[row][column] * sums[column];
      squared += N[row][column] * N[row][column];
    });
    unrolled<row + 1>([&](auto column) { bias[column] += N[row][column] * half[row]; });
  });
  squared *= noise;
  for (const Floats& x : bias) squared += x * x;
  constexpr float kWorst = 1e6F;  // [m^2]
  return lanes::where(sound & (squared < kWorst), squared, lanes::floats(kWorst));
}

/// Chooses greedily: of some candidates, the element after which the error of the poses is least.
class Choice {
 public:
  Choice(const RegionElements& region, float noise, float power)
      : noise_(noise), power_(power), begin_(region.elements.size() + 1, 0) {
    for (const auto& scan : region.scans) {
      for (const Pull& pull : scan) ++begin_[pull.element + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    touches_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t s = 0; s < region.scans.size(); ++s) {
      for (const Pull& pull : region.scans[s]) {
        touches_[next[pull.element]++] = {s, pull.element, Sums::of(pull)};
      }
    }
    Scan scan{.sums = Sums::prior()};
    scan.cost = costs({scan.sums, scan.sums, scan.sums, scan.sums})[0];
    scans_.assign(region.scans.size(), scan);
  }

  [[nodiscard]] bool touches(std::uint32_t element) const noexcept {
    return begin_[element] < begin_[element + 1];
  }
  /// An element that touches scans, drawn in proportion to how many it touches.
  [[nodiscard]] std::uint32_t drawn(std::uint64_t number) const noexcept {
    return touches_[static_cast<std::size_t>(number % touches_.size())].element;
  }

  /// By how much the errors grow with an element; negative for a good one.
  [[nodiscard]] float growth_with(std::uint32_t element) const {
    float growth = 0.0F;
    for_each_touch(element, [&](std::uint32_t scan, const Sums& /*with*/, float cost) {
      growth += cost - scans_[scan].cost;
    });
    return growth;
  }

  void take(std::uint32_t element) {
    for_each_touch(element, [&](std::uint32_t scan, const Sums& with, float cost) {
      scans_[scan] = {with, cost};
    });
  }

 private:
  struct Touch {
    std::uint32_t scan = 0, element = 0;
    Sums sums;
  };
  struct Scan {
    Sums sums;
    float cost = 0.0F;
  };

  [[nodiscard]] Floats costs(const std::array<Sums, kLanes>& poses) const {
    Floats squared = squared_errors(poses, noise_);
    if (power_ == 0.5F) return lanes::root<3>(squared);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      squared[lane] = std::pow(squared[lane], power_);
    }
    return squared;
  }
  /// Calls use(scan, its sums with the element, its cost then).
  template <class Use>
  void for_each_touch(std::uint32_t element, const Use& use) const {
    const auto all = std::span(touches_).first(begin_[element + 1]);
    for (std::size_t k = begin_[element]; k < all.size(); k += kLanes) {
      const auto some = all.subspan(k, std::min(kLanes, all.size() - k));
      std::array<Sums, kLanes> with;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const Touch& touch = some[std::min(lane, some.size() - 1)];
        with[lane] = scans_[touch.scan].sums.with(touch.sums);
      }
      const Floats then = costs(with);
      for (std::size_t lane = 0; lane < some.size(); ++lane) {
        use(some[lane].scan, with[lane], then[lane]);
      }
    }
  }

  float noise_, power_;
  std::vector<std::size_t> begin_;  // of an element's touches
  std::vector<Touch> touches_;
  std::vector<Scan> scans_;
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
  double noise = 0.1;
  double power = 0.5;
  std::uint64_t seed = 17;

  static constexpr auto schema() {
    return std::tuple{
        vantage::optional("candidates", &Contribution::candidates, "",
                          "elements that are tried for the first that is chosen; half as many "
                          "after 100, and so on, down to 8",
                          vantage::at_least(1)),
        vantage::optional("noise", &Contribution::noise, "",
                          "how much the noise of scans counts beside the bias of elements",
                          vantage::between(1e-3, 1e3)),
        // Beyond these, numbers of single precision cannot tell one choice from another.
        vantage::optional("power", &Contribution::power, "", "of the squared error",
                          vantage::between(0.05, 4.0)),
        vantage::optional("seed", &Contribution::seed, "", "another seed tries other candidates"),
    };
  }

  /// The first elements decide most, so they are chosen with most care.
  [[nodiscard]] std::size_t candidates_after(std::size_t chosen) const {
    constexpr std::size_t kHalved = 100, kFewest = 8;
    const std::size_t fewer = candidates * kHalved / (kHalved + chosen);
    return std::max(std::min<std::size_t>(candidates, kFewest), fewer);
  }

  [[nodiscard]] std::uint32_t candidate(const Choice& choice, const Left& left, std::size_t step,
                                        std::size_t k) const {
    const std::uint64_t number = hash(seed, step, k);
    // Few elements hold the pose everywhere only if each is seen from many places.
    const std::uint32_t one = choice.drawn(number);
    return left.has(one) ? one : left[number % left.size()];
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
    while (order.size() < most && left.size() > 0) {
      const std::size_t tried = std::min(candidates_after(order.size()), left.size());
      std::uint32_t best = left[0];
      float least = std::numeric_limits<float>::infinity();
      for (std::size_t k = 0; k < tried; ++k) {
        const std::uint32_t one = candidate(choice, left, order.size(), k);
        const float growth = choice.growth_with(one);
        if (!(growth < least)) continue;
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
