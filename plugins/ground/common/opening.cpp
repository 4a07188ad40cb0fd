#include "common/opening.hpp"

#include <algorithm>
#include <limits>
#include <span>

namespace vantage::terrain {
namespace {

constexpr double kAboveAll = std::numeric_limits<double>::infinity();

/// Extremes of a line over a running window. They come from extremes that run forward and backward
/// within blocks of the window's length: three comparisons per value.
class RunningWindow {
 public:
  RunningWindow(std::size_t window, std::size_t longest)
      : window_(window), forward_(longest), backward_(longest) {}

  /// out[i] = extreme of in[i] ... in[i + window - 1]
  template <class Extreme>
  void run(std::span<const double> in, std::span<double> out, const Extreme& extreme) {
    const std::size_t n = in.size();
    for (std::size_t begin = 0; begin < n; begin += window_) {
      const std::size_t end = std::min(begin + window_, n);
      double ahead = in[begin], behind = in[end - 1];
      for (std::size_t i = begin; i < end; ++i) forward_[i] = ahead = extreme(ahead, in[i]);
      for (std::size_t i = end; i-- > begin;) backward_[i] = behind = extreme(behind, in[i]);
    }
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = extreme(backward_[i], forward_[i + window_ - 1]);
    }
  }

 private:
  std::size_t window_;
  std::vector<double> forward_, backward_;
};

/// Erodes along the rows. The grid grows by `radius` on both sides, because squares may cross its
/// border.
Heights eroded_rows(const Heights& in, std::size_t radius) {
  Heights out{in.width + 2 * radius, in.height, {}};
  out.z.resize(out.width * out.height);
  std::vector<double> line(in.width + 4 * radius, kAboveAll);
  RunningWindow window(2 * radius + 1, line.size());
  for (std::size_t y = 0; y < in.height; ++y) {
    const auto row = in.z.begin() + static_cast<std::ptrdiff_t>(y * in.width);
    std::copy_n(row, in.width, line.begin() + static_cast<std::ptrdiff_t>(2 * radius));
    window.run(line, std::span(out.z).subspan(y * out.width, out.width),
               [](double a, double b) { return std::min(a, b); });
  }
  return out;
}

/// Dilates along the rows. The grid shrinks back.
Heights dilated_rows(const Heights& in, std::size_t radius) {
  Heights out{in.width - 2 * radius, in.height, {}};
  out.z.resize(out.width * out.height);
  RunningWindow window(2 * radius + 1, in.width);
  for (std::size_t y = 0; y < in.height; ++y) {
    window.run(std::span(in.z).subspan(y * in.width, in.width),
               std::span(out.z).subspan(y * out.width, out.width),
               [](double a, double b) { return std::max(a, b); });
  }
  return out;
}

Heights transposed(const Heights& in) {
  constexpr std::size_t kBlock = 32;  // both sides of a block stay in the cache
  Heights out{in.height, in.width, std::vector<double>(in.z.size())};
  for (std::size_t y0 = 0; y0 < in.height; y0 += kBlock) {
    for (std::size_t x0 = 0; x0 < in.width; x0 += kBlock) {
      for (std::size_t y = y0; y < std::min(y0 + kBlock, in.height); ++y) {
        for (std::size_t x = x0; x < std::min(x0 + kBlock, in.width); ++x) {
          out.z[x * out.width + y] = in.z[y * in.width + x];
        }
      }
    }
  }
  return out;
}

}  // namespace

Heights opening(const Heights& heights, std::size_t radius) {
  Heights columns = transposed(eroded_rows(heights, radius));
  columns = dilated_rows(eroded_rows(columns, radius), radius);
  return dilated_rows(transposed(columns), radius);
}

}  // namespace vantage::terrain
