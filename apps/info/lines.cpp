#include "info/lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "terminal/table.hpp"

namespace vantage {

std::string to_text(const Lines& lines, const cli::Style& style) {
  std::size_t width = 0;
  for (const auto& [name, value] : lines) width = std::max(width, name.size());
  std::string text;
  for (const auto& [name, value] : lines) {
    text +=
        style.bold(name) + std::string(width - name.size() + 2, ' ') + cli::one_line(value) + '\n';
  }
  return text;
}

std::string box_text(const Eigen::AlignedBox3d& extent) {
  if (extent.isEmpty()) return "none";
  const auto axis = [&](const char* name, Eigen::Index i) {
    return fmt::format("{} {:.2f} to {:.2f}", name, extent.min()[i], extent.max()[i]);
  };
  return fmt::format("{}, {}, {}", axis("x", 0), axis("y", 1), axis("z", 2));
}

nlohmann::ordered_json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace vantage
