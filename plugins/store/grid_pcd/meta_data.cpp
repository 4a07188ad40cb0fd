#include "meta_data.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>

namespace vantage::grid_pcd {
namespace {

constexpr std::string_view kBlank = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::optional<double> number_in(std::string_view text) {
  double x = 0.0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, x);
  if (read.ec != std::errc() || read.ptr != end || !std::isfinite(x)) return std::nullopt;
  return x;
}

/// The value of each key, found once.
struct Found {
  std::optional<double> grid_size;
  std::array<std::optional<double>, 2> min, max;
};

/// Takes line after line. A corner, `min_pt` or `max_pt`, has its coordinates in the lines below.
class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file) {}

  Result<void> take(std::string_view line) {
    ++number_;
    line = line.substr(0, line.find('#'));
    const bool inside = !line.empty() && kBlank.find(line.front()) != std::string_view::npos;
    line = trimmed(line);
    if (line.empty()) return {};
    const std::size_t colon = line.find(':');
    const std::string_view key = trimmed(line.substr(0, colon));
    const std::string_view value =
        colon == std::string_view::npos ? std::string_view() : trimmed(line.substr(colon + 1));
    if (!inside) corner_ = nullptr;
    if (colon == std::string_view::npos) return wrong("expected 'key: value'");
    if (inside && corner_ != nullptr && (key == "x" || key == "y")) {
      return set((*corner_)[key == "x" ? 0 : 1], key, value);
    }
    if (!inside && key == "grid_size") return set(found_.grid_size, key, value);
    if (!inside && (key == "min_pt" || key == "max_pt")) {
      if (!value.empty()) return wrong("expected the lines 'x: ...' and 'y: ...' below this one");
      corner_ = key == "min_pt" ? &found_.min : &found_.max;
      return {};
    }
    return wrong("unknown key '" + std::string(key) +
                 "'; known are grid_size, and min_pt and max_pt, each with x and y below it");
  }

  Result<MetaData> finish() const {
    for (const auto& [value, key] :
         {std::pair{found_.grid_size, "grid_size"}, std::pair{found_.min[0], "min_pt: x"},
          std::pair{found_.min[1], "min_pt: y"}, std::pair{found_.max[0], "max_pt: x"},
          std::pair{found_.max[1], "max_pt: y"}}) {
      if (!value) return at(0, std::string("missing key '") + key + "'");
    }
    MetaData data;
    data.grid_size = *found_.grid_size;
    data.min = {*found_.min[0], *found_.min[1]};
    data.max = {*found_.max[0], *found_.max[1]};
    if (!(data.grid_size > 0.0)) return at(0, "'grid_size' must be above 0 m");
    if (!(data.min.array() <= data.max.array()).all()) {
      return at(0, "'min_pt' lies beyond 'max_pt'");
    }
    return data;
  }

 private:
  Result<void> set(std::optional<double>& to, std::string_view key, std::string_view value) {
    if (to) return wrong("'" + std::string(key) + "' is given twice");
    to = number_in(value);
    if (to) return {};
    return wrong("'" + std::string(key) + "' must be a finite number, not '" + std::string(value) +
                 "'");
  }
  [[nodiscard]] tl::unexpected<Error> wrong(std::string message) const {
    return at(number_, std::move(message));
  }
  [[nodiscard]] tl::unexpected<Error> at(std::uint32_t line, std::string message) const {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file_, line, 0});
  }

  const std::string& file_;
  std::uint32_t number_ = 0;
  Found found_;
  std::array<std::optional<double>, 2>* corner_ = nullptr;
};

}  // namespace

HalfOpenBox MetaData::cell(std::uint32_t i, std::uint32_t j) const {
  const auto edge = [&](Eigen::Index axis, double index) { return min[axis] + index * grid_size; };
  return {{edge(0, i), edge(1, j)}, {edge(0, i + 1.0), edge(1, j + 1.0)}};
}

Eigen::Vector2d MetaData::most_cells() const {
  constexpr double kRounding = 1e-5;  // of six digits, of both corners
  const Eigen::Array2d rounding = kRounding * min.array().abs().max(max.array().abs());
  return (((max - min).array() + rounding) / grid_size).floor() + 1.0;
}

Result<MetaData> parse_meta_data(std::string_view text, const std::string& file) {
  Reader reader(file);
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    VANTAGE_CHECK(reader.take(text.substr(0, end)));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return reader.finish();
}

}  // namespace vantage::grid_pcd
