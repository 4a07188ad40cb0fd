#include "vantage/io/map_files.hpp"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "io/autoware_tiles.hpp"
#include "io/formats.hpp"
#include "io/scan_sequence.hpp"
#include "vantage/io/tiled_map.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> error_at(const fs::path& path, ErrorCode code, std::string message) {
  return fail(code, std::move(message), SourceLocation{path.string(), 0, 0});
}

void sort_naturally(std::vector<fs::path>& paths) {
  std::sort(paths.begin(), paths.end(), [](const fs::path& a, const fs::path& b) {
    return less_by_natural_order(a.native(), b.native());
  });
}

/// The files of a folder whose suffixes are those of point clouds.
Result<std::vector<fs::path>> clouds_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const bool is_cloud =
        !it->path().filename().string().starts_with('.') && has_extension_of(kMap, it->path());
    std::error_code ignored;
    if (is_cloud && !it->is_directory(ignored)) files.push_back(it->path());
  }
  if (error) {
    return error_at(folder, ErrorCode::io_failure,
                    fmt::format("the folder cannot be listed ({})", error.message()));
  }
  sort_naturally(files);
  return files;
}

/// Where the parts of an Autoware map are.
struct AutowareMap {
  fs::path metadata, tiles;
};

/// The folder may be that of the map, which contains the metadata, or that of its tiles.
std::optional<AutowareMap> autoware_map(const fs::path& folder) {
  std::error_code ignored;
  const fs::path inside = folder / kAutowareMetadata;
  if (fs::is_regular_file(inside, ignored)) {
    const fs::path tiles = folder / kAutowareFolder;
    return AutowareMap{inside, fs::is_directory(tiles, ignored) ? tiles : folder};
  }
  const fs::path whole = fs::canonical(folder, ignored);
  if (whole.filename() != kAutowareFolder) return std::nullopt;
  const fs::path beside = whole.parent_path() / kAutowareMetadata;
  if (!fs::is_regular_file(beside, ignored)) return std::nullopt;
  return AutowareMap{beside, folder};
}

class Finder {
 public:
  [[nodiscard]] Result<void> add(const fs::path& pattern) {
    std::error_code ignored;
    if (fs::exists(pattern, ignored)) return add_existing(pattern);
    VANTAGE_TRY(std::vector<fs::path> matches, matches_of(pattern));
    sort_naturally(matches);
    for (const fs::path& match : matches) VANTAGE_CHECK(add_existing(match));
    return {};
  }

  [[nodiscard]] MapFiles result() && { return std::move(found_); }

 private:
  [[nodiscard]] static Result<std::vector<fs::path>> matches_of(const fs::path& pattern) {
    const bool has_wildcard = pattern.native().find_first_of("*?[") != std::string::npos;
    struct Matches : glob_t {
      Matches() : glob_t{} {}
      ~Matches() { ::globfree(this); }
    } matches;
    const auto stop = [](const char*, int reason) {
      return reason == ENOENT || reason == ENOTDIR ? 0 : 1;
    };
    const int status =
        has_wildcard ? ::glob(pattern.c_str(), GLOB_NOSORT, stop, &matches) : GLOB_NOMATCH;
    if (status == GLOB_NOMATCH) {
      return error_at(pattern, ErrorCode::not_found,
                      has_wildcard ? "no file matches this pattern"
                                   : "there is no such file, expected a point cloud or a folder of "
                                     "them");
    }
    if (status != 0) {
      return error_at(pattern, ErrorCode::io_failure,
                      "a folder on the way of this pattern cannot be listed");
    }
    return std::vector<fs::path>(matches.gl_pathv, matches.gl_pathv + matches.gl_pathc);
  }

  [[nodiscard]] Result<void> add_existing(const fs::path& path) {
    std::error_code ignored;
    if (!fs::is_directory(path, ignored)) {
      add_file(path);
      return {};
    }
    if (is_tiled_map(path)) {
      add_file(path);
      return {};
    }
    if (const auto map = autoware_map(path)) return add_tiles(*map);
    VANTAGE_TRY(const auto files, clouds_in(path));
    if (files.empty()) {
      return error_at(path, ErrorCode::not_found,
                      fmt::format("the folder holds no point cloud ({})", extension_list(kMap)));
    }
    for (const fs::path& file : files) add_file(file);
    return {};
  }

  [[nodiscard]] Result<void> add_tiles(const AutowareMap& map) {
    VANTAGE_TRY(const FileContent yaml, read_file(map.metadata, "a list of Autoware's map tiles"));
    VANTAGE_TRY(const auto metadata, parse_autoware_tiles(yaml.view(), map.metadata.string()));
    std::vector<fs::path> tiles;
    for (const AutowareTile& tile : metadata.tiles) tiles.push_back(map.tiles / tile.file);
    sort_naturally(tiles);
    for (const fs::path& tile : tiles) {
      std::error_code ignored;
      if (fs::is_regular_file(tile, ignored)) continue;
      return error_at(
          tile, ErrorCode::not_found,
          fmt::format("there is no such tile, though {} lists it", map.metadata.string()));
    }
    if (tiles.empty()) {
      return error_at(map.metadata, ErrorCode::not_found, "the metadata list no tile");
    }
    VANTAGE_TRY(const auto present, clouds_in(map.tiles));
    const std::set<fs::path> listed(tiles.begin(), tiles.end());
    found_.unlisted_tiles += static_cast<std::uint64_t>(
        std::count_if(present.begin(), present.end(),
                      [&](const fs::path& file) { return !listed.contains(file); }));
    for (const fs::path& tile : tiles) add_file(tile);
    return {};
  }

  void add_file(const fs::path& path) {
    std::error_code failed;
    const fs::path same = fs::canonical(path, failed);
    if (seen_.insert(failed ? path : same).second) found_.files.push_back(path);
  }

  MapFiles found_;
  std::set<fs::path> seen_;
};

}  // namespace

Result<MapFiles> map_files(std::span<const fs::path> patterns) {
  Finder finder;
  for (const fs::path& pattern : patterns) VANTAGE_CHECK(finder.add(pattern));
  return std::move(finder).result();
}

}  // namespace vantage::io
