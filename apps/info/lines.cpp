#include "info/lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <system_error>

#include "terminal/table.hpp"

namespace vantage {

namespace fs = std::filesystem;

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

std::uint64_t size_of(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    const auto size = fs::file_size(path, error);
    return error ? 0 : size;
  }
  std::uint64_t sum = 0;
  for (fs::recursive_directory_iterator it(path, error), end; !error && it != end;
       it.increment(error)) {
    std::error_code unreadable;
    const auto size = it->is_regular_file(unreadable) ? it->file_size(unreadable) : 0;
    if (!unreadable) sum += size;
  }
  return sum;
}

}  // namespace vantage
