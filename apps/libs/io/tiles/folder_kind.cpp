#include "io/tiles/folder_kind.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include "io/tiles/index.hpp"
#include "io/tiles/state.hpp"

namespace vantage::io::tiles {
namespace {

bool is_own(std::string_view name) {
  return name == kIndexFile || name == kStateFile ||
         (name.starts_with("points_") && name.ends_with(".pack") &&
          name.find('/') == std::string_view::npos);
}

}  // namespace

FolderKind tiled_map_kind() {
  return {.what = "a tiled map",
          .overwrite = "--overwrite",
          .check = [](const auto& /*folder*/, auto names) -> Result<void> {
            for (const std::string& name : names) {
              if (!is_own(name)) return it_holds(name);
            }
            if (names.empty() || std::ranges::count(names, kIndexFile) > 0) return {};
            return fail(ErrorCode::already_exists, std::string("it holds no ") + kIndexFile);
          },
          .may_hold = is_own,
          .progress = kStateFile};
}

}  // namespace vantage::io::tiles
