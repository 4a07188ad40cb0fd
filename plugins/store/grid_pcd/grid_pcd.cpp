#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "grid_file.hpp"
#include "meta_data.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/directory_of.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/kit/numbers.hpp"
#include "vantage/plugin.hpp"

namespace vantage::grid_pcd {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMetaDataAttachment = "grid_meta_data";

tl::unexpected<Error> error_at(const fs::path& place, ErrorCode code, std::string message) {
  return fail(code, std::move(message), SourceLocation{place.string(), 0, 0});
}

/// A folder whose files were all read once.
struct Opened {
  MapIndex index;
  std::vector<std::string> files;        // by RegionId
  std::vector<std::uint64_t> checksums;  // of the files
  std::string meta_data;                 // the text of its file
};

/// The files of cells in a folder, by rows.
Result<std::vector<std::pair<CellIndex, std::string>>> cells_in(const fs::path& root) {
  std::vector<std::pair<CellIndex, std::string>> cells;
  std::error_code error;
  for (fs::directory_iterator it(root, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (!is_grid_file(name)) continue;
    const auto cell = cell_of(name);
    if (!cell) {
      return error_at(it->path(), ErrorCode::corrupt_data,
                      "is not named grid_<i>_<j>.pcd: expected the two indices of a cell, without "
                      "sign and leading zeros, as in grid_3_0.pcd");
    }
    cells.emplace_back(*cell, name);
  }
  if (error) {
    return error_at(root, ErrorCode::io_failure,
                    "the folder cannot be listed (" + error.message() + ")");
  }
  std::ranges::sort(cells);
  return cells;
}

Result<MetaData> meta_data_in(const fs::path& root, std::string& text) {
  const fs::path file = root / kMetaData;
  const auto content = io::read_file(file, "the size and the corners of the grid");
  if (content) {
    text = content->view();
    return parse_meta_data(text, file.string());
  }
  if (content.error().code != ErrorCode::not_found) return fail(content.error());
  std::error_code ignored;
  if (fs::is_directory(root, ignored)) {
    VANTAGE_TRY(const auto cells, cells_in(root));
    if (!cells.empty()) {
      return error_at(root, ErrorCode::corrupt_data,
                      std::string(kMetaData) + " is missing; expected it beside " +
                          cells.front().second + ", with the size and the corners of the grid");
    }
  }
  return error_at(root, ErrorCode::not_found,
                  std::string("there is no bundle of region maps here: no ") + kMetaData);
}

/// Refuses a cell that the meta data does not have.
Result<void> check_inside(const CellIndex& cell, const MetaData& grid, const fs::path& file) {
  const Eigen::Vector2d most = grid.most_cells();
  if (cell.i < most.x() && cell.j < most.y()) return {};
  return error_at(file, ErrorCode::corrupt_data,
                  "cell " + std::to_string(cell.i) + ", " + std::to_string(cell.j) +
                      " lies beyond max_pt of " + kMetaData + ": expected indices below " +
                      shortest(most.x()) + ", " + shortest(most.y()));
}

Result<Opened> open_folder(const fs::path& root) {
  Opened opened;
  VANTAGE_TRY(const MetaData grid, meta_data_in(root, opened.meta_data));
  VANTAGE_TRY(const auto cells, cells_in(root));
  if (cells.empty()) {
    return error_at(root, ErrorCode::corrupt_data,
                    std::string("there is a ") + kMetaData +
                        ", but no grid_<i>_<j>.pcd: expected the map of a cell in each");
  }
  std::vector<Region> regions;
  for (const auto& [cell, name] : cells) {
    const fs::path file = root / name;
    VANTAGE_CHECK(check_inside(cell, grid, file));
    VANTAGE_TRY(const io::FileContent content, io::read_file(file, "the map of a cell"));
    VANTAGE_TRY(const PointCloud points, points_in(content.view(), file.string()));
    regions.push_back({label_of(cell), grid.cell(cell.i, cell.j), {}});
    opened.index.regions.push_back({.points = points.size(), .bytes = content.size});
    for (const Point& p : points) opened.index.map_bounds.extend(p);
    opened.files.push_back(name);
    opened.checksums.push_back(checksum_of(content.view()));
  }
  auto partition = Partition::from(std::move(regions));
  if (!partition) {  // a grid_size below the rounding of the corners
    return error_at(root / kMetaData, ErrorCode::corrupt_data, partition.error().message);
  }
  opened.index.partition = *std::move(partition);
  return opened;
}

class GridReader final : public MapReader {
 public:
  GridReader(fs::path root, Opened opened) : root_(std::move(root)), opened_(std::move(opened)) {}

  [[nodiscard]] Result<MapIndex> index() const noexcept override {
    return guarded([&]() -> Result<MapIndex> { return opened_.index; });
  }
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept override {
    return guarded([&] { return directory_of(opened_.index); });
  }
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override {
    return guarded([&]() -> Result<RegionMap> {
      if (region.value >= opened_.files.size()) {
        return error_at(root_, ErrorCode::not_found,
                        "there is no region " + std::to_string(region.value) + "; there are " +
                            std::to_string(opened_.files.size()));
      }
      const fs::path file = root_ / opened_.files[region.value];
      auto content = io::read_file(file, "the map of a cell");
      if (!content && content.error().code == ErrorCode::not_found) {
        return error_at(file, ErrorCode::corrupt_data,
                        "is missing; it was here when the folder was opened");
      }
      if (!content) return fail(std::move(content).error());
      if (checksum_of(content->view()) != opened_.checksums[region.value]) {
        return error_at(file, ErrorCode::corrupt_data, "has changed since the folder was opened");
      }
      RegionMap map;
      VANTAGE_TRY(map.points, points_in(content->view(), file.string()));
      return map;
    });
  }
  /// `grid_meta_data` is the text of that file.
  [[nodiscard]] Result<std::vector<std::byte>> attachment(
      std::string_view name) const noexcept override {
    return guarded([&]() -> Result<std::vector<std::byte>> {
      if (name != kMetaDataAttachment) return MapReader::attachment(name);
      const auto bytes = std::as_bytes(std::span(opened_.meta_data));
      return std::vector<std::byte>(bytes.begin(), bytes.end());
    });
  }

 private:
  fs::path root_;
  Opened opened_;
};

/// A folder of the program that the paper's authors have published.
class GridPcd final : public MapStore {
 public:
  struct Params {
    fs::path root;
    static constexpr auto schema() {
      return std::tuple{required("root", &Params::root, "",
                                 "folder with grid_meta_data.yaml and grid_<i>_<j>.pcd")};
    }
  };

  static Result<std::unique_ptr<MapStore>> create(const Params& params) {
    return std::make_unique<GridPcd>(params);
  }
  explicit GridPcd(const Params& params) : root_(params.root) {}

  [[nodiscard]] Result<void> may_begin() const noexcept override { return only_reads(); }
  [[nodiscard]] Result<std::unique_ptr<MapWriter>> begin(
      const MapIndex& /*index*/) const noexcept override {
    return only_reads();
  }
  [[nodiscard]] Result<std::unique_ptr<const MapReader>> open() const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<const MapReader>> {
      VANTAGE_TRY(Opened opened, open_folder(root_));
      return std::make_unique<const GridReader>(root_, std::move(opened));
    });
  }

 private:
  static tl::unexpected<Error> only_reads() {
    return fail(ErrorCode::unsupported,
                "the store grid_pcd only reads; `vantage export grid` writes such a folder");
  }

  fs::path root_;
};

}  // namespace
}  // namespace vantage::grid_pcd

VANTAGE_PLUGIN(vantage::MapStore, vantage::grid_pcd::GridPcd, "grid_pcd",
               "reads the folder that the program of the paper's authors writes");
