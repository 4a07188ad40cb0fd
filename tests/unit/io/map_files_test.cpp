#include "vantage/io/map_files.hpp"

#include <unistd.h>

#include "files.hpp"
#include "io/autoware_tiles.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using io::map_files;
using test::check_clear;
using test::put;

class Folder {
 public:
  explicit Folder(const std::vector<std::string>& files) {
    for (const std::string& name : files) {
      fs::create_directories((folder_.path() / name).parent_path());
      put(folder_.path() / name, "x");
    }
  }

  [[nodiscard]] fs::path operator/(const std::string& name) const { return folder_.path() / name; }

  /// What the patterns find, relative to the folder.
  [[nodiscard]] std::vector<std::string> find(const std::vector<std::string>& patterns) const {
    const auto found = map_files(paths(patterns));
    REQUIRE_MESSAGE(found, to_string(found.error()));
    std::vector<std::string> names;
    for (const fs::path& file : found->files) {
      names.push_back(file.lexically_relative(folder_.path()).string());
    }
    return names;
  }

  void refused(const std::vector<std::string>& patterns, ErrorCode code, const std::string& where,
               const std::string& expected) const {
    const auto found = map_files(paths(patterns));
    REQUIRE_FALSE(found.has_value());
    check_clear(found.error(), code, where, expected);
  }

  [[nodiscard]] std::vector<fs::path> paths(const std::vector<std::string>& patterns) const {
    std::vector<fs::path> paths;
    for (const std::string& pattern : patterns) paths.push_back(folder_.path() / pattern);
    return paths;
  }

 private:
  test::TemporaryFolder folder_;
};

using Names = std::vector<std::string>;

TEST_CASE("map files: files, folders and patterns, in natural order, each once") {
  const Folder folder({"a.pcd", "m/t10.las", "m/t2.las", "m/t1.PLY", "m/notes.txt", "m/.hidden.pcd",
                       "m/deep/x.pcd", "n/[1].pcd", "n/1.pcd"});
  CHECK(folder.find({"a.pcd"}) == Names{"a.pcd"});
  CHECK(folder.find({"m/t2.las", "a.pcd"}) == Names{"m/t2.las", "a.pcd"});
  CHECK(folder.find({"m"}) == Names{"m/t1.PLY", "m/t2.las", "m/t10.las"});
  CHECK(folder.find({"m/"}) == Names{"m/t1.PLY", "m/t2.las", "m/t10.las"});
  CHECK(folder.find({"m/*.las"}) == Names{"m/t2.las", "m/t10.las"});
  CHECK(folder.find({"m/t?.*"}) == Names{"m/t1.PLY", "m/t2.las"});
  CHECK(folder.find({"*/t[12].*"}) == Names{"m/t1.PLY", "m/t2.las"});
  CHECK(folder.find({"m/t10.las", "m/*.las", "m", "m/../m/t1.PLY"}) ==
        Names{"m/t10.las", "m/t2.las", "m/t1.PLY"});
  CHECK(folder.find({"n/[1].pcd"}) == Names{"n/[1].pcd"});  // it exists
  CHECK(folder.find({"n/[1]*"}) == Names{"n/1.pcd"});
  CHECK(folder.find({"m/d*"}) == Names{"m/deep/x.pcd"});  // a folder
  CHECK(map_files({})->files.empty());
}

TEST_CASE("map files: a link to a file is that file") {
  const Folder folder({"a.pcd"});
  fs::create_symlink("a.pcd", folder / "b.pcd");
  CHECK(folder.find({"*.pcd"}) == Names{"a.pcd"});
}

TEST_CASE("map files: formats that are not read are found, so that it is said") {
  const Folder folder({"m/a.laz", "m/b.e57"});
  CHECK(folder.find({"m"}) == Names{"m/a.laz", "m/b.e57"});
}

TEST_CASE("map files: what is not there") {
  const Folder folder({"a.pcd", "m/notes.txt"});
  folder.refused({"b.pcd"}, ErrorCode::not_found, "b.pcd", "there is no such file");
  folder.refused({"a.pcd", "*.las"}, ErrorCode::not_found, "*.las", "no file matches this pattern");
  folder.refused({"none/*"}, ErrorCode::not_found, "none/*", "no file matches this pattern");
  folder.refused({"m"}, ErrorCode::not_found, "m", "the folder holds no point cloud");
  if (::geteuid() == 0) return;  // may read any folder
  fs::permissions(folder / "m", fs::perms::none);
  folder.refused({"m"}, ErrorCode::io_failure, "m", "cannot be listed");
  folder.refused({"m/*.las"}, ErrorCode::io_failure, "m/*.las", "cannot be listed");
  fs::permissions(folder / "m", fs::perms::owner_all);
}

const std::string kMetadata =
    "x_resolution: 20.0\ny_resolution: 20.0\nt_20_0.pcd: [20, 0]\nt_0_0.pcd: [0, 0]\n";
const std::string kMap = "map/pointcloud_map.pcd";

TEST_CASE("map files: Autoware's tiles, by the map's folder, the tiles' folder or a pattern") {
  const Folder folder({kMap + "/t_0_0.pcd", kMap + "/t_20_0.pcd", "map/lanelet2_map.osm"});
  const Names tiles{kMap + "/t_0_0.pcd", kMap + "/t_20_0.pcd"};
  CHECK(folder.find({kMap}) == tiles);  // no metadata yet: a folder like others
  put(folder / "map" / io::kAutowareMetadata, kMetadata);
  for (const std::string& name : {std::string("map"), kMap, kMap + "/", std::string("m*")}) {
    CAPTURE(name);
    CHECK(folder.find({name}) == tiles);
  }
  CHECK(map_files(folder.paths({"map"}))->unlisted_tiles == 0);

  put(folder / kMap / "t_40_0.pcd", "x");
  put(folder / kMap / "notes.txt", "x");
  CHECK(folder.find({"map"}) == tiles);
  CHECK(map_files(folder.paths({"map"}))->unlisted_tiles == 1);

  fs::remove(folder / kMap / "t_20_0.pcd");
  folder.refused({"map"}, ErrorCode::not_found, "t_20_0.pcd", "there is no such tile");
  put(folder / "map" / io::kAutowareMetadata, "x_resolution: 20.0\ny_resolution: 20.0\n");
  folder.refused({"map"}, ErrorCode::not_found, io::kAutowareMetadata, "list no tile");
  put(folder / "map" / io::kAutowareMetadata, "x_resolution: 20.0\n");
  folder.refused({kMap}, ErrorCode::corrupt_data, io::kAutowareMetadata, "no y_resolution");
}

TEST_CASE("map files: Autoware's metadata among the tiles, or beside a map of one file") {
  const Folder tiles({"all/t_0_0.pcd", "all/t_20_0.pcd"});
  put(tiles / "all" / io::kAutowareMetadata, kMetadata);
  CHECK(tiles.find({"all"}) == Names{"all/t_0_0.pcd", "all/t_20_0.pcd"});
  const Folder one({kMap});
  put(one / "map" / io::kAutowareMetadata,
      "x_resolution: 20.0\ny_resolution: 20.0\npointcloud_map.pcd: [0, 0]\n");
  CHECK(one.find({"map"}) == Names{kMap});
  CHECK(one.find({kMap}) == Names{kMap});
}

}  // namespace
}  // namespace vantage
