#pragma once

#include "vantage/kit/atomic_folder.hpp"

namespace vantage::io::tiles {

/// What the folder of a tiled map holds. An unfinished one is continued from its state.
[[nodiscard]] FolderKind tiled_map_kind();

}  // namespace vantage::io::tiles
