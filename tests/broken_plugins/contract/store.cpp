// pcd_tiles, but for the clause to be broken.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <utility>

#include "breaks.hpp"
#include "vantage/kit/directory_of.hpp"

namespace vantage::broken {
namespace {

namespace fs = std::filesystem;

class BrokenReader final : public MapReader {
 public:
  BrokenReader(std::shared_ptr<const MapStore> store, std::unique_ptr<const MapReader> sound)
      : store_(std::move(store)), sound_(std::move(sound)) {}

  [[nodiscard]] Result<MapIndex> index() const noexcept override { return sound_->index(); }
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override {
    return guarded([&]() -> Result<RegionMap> {
      if (breaks("S12")) {  // reads the bundle that is there by now
        VANTAGE_TRY(const auto now, store_->open());
        return now->get(region);
      }
      // An end that is counted in.
      const auto index = breaks("S3") ? sound_->index() : Result<MapIndex>();
      if (breaks("S3") && index && region.value == index->regions.size()) --region.value;
      auto map = sound_->get(region);
      if (breaks("S6") && !map && map.error().code == ErrorCode::corrupt_data) return RegionMap{};
      // A buffer that all calls share.
      if (breaks("S5") && Crowded(inside_) && map) std::swap(map->points[0], map->points[1]);
      return map;
    });
  }
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<const RegionDirectory>> {
      if (!breaks("S25") && !breaks("S6_directory")) return sound_->directory();
      VANTAGE_TRY(MapIndex all, index());
      for (std::uint32_t r = 0; r < all.regions.size(); ++r) {
        std::uint64_t& points = all.regions[r].points;
        if (breaks("S25")) points = std::max<std::uint64_t>(points, 1);  // no region is empty
        if (!breaks("S6_directory")) continue;
        const auto map = sound_->get(RegionId{r});  // counts what it can read
        if (!map && map.error().code == ErrorCode::corrupt_data) points = 0;
      }
      return directory_of(std::move(all));
    });
  }
  [[nodiscard]] Result<std::vector<std::byte>> attachment(
      std::string_view name) const noexcept override {
    return guarded([&]() -> Result<std::vector<std::byte>> {
      if (offers_least()) return MapReader::attachment(name);
      auto bytes = sound_->attachment(name);
      if (bytes) return bytes;
      if (breaks("S19") && bytes.error().code == ErrorCode::not_found) {
        return fail(ErrorCode::io_failure, "no such file");
      }
      if (breaks("S24") && bytes.error().code == ErrorCode::corrupt_data) bytes.emplace();
      return bytes;
    });
  }
  [[nodiscard]] Result<void> attach(std::string_view name,
                                    std::span<const std::byte> bytes) const noexcept override {
    if (breaks("S21")) return {};
    if (offers_least()) return MapReader::attach(name, bytes);
    return sound_->attach(name, bytes);
  }

 private:
  std::shared_ptr<const MapStore> store_;  // keeps the library of `sound_`
  std::unique_ptr<const MapReader> sound_;
  mutable std::atomic<int> inside_ = 0;
};

class BrokenWriter final : public MapWriter {
 public:
  BrokenWriter(std::shared_ptr<const MapStore> store, std::unique_ptr<MapWriter> sound,
               std::size_t regions, fs::path folder)
      : store_(std::move(store)),
        sound_(std::move(sound)),
        regions_(regions),
        folder_(std::move(folder)) {}

  [[nodiscard]] Result<void> put(RegionId region, const RegionMap& map) noexcept override {
    return guarded([&] { return put_checked(region, map); });
  }
  [[nodiscard]] Result<void> attach(std::string_view name,
                                    std::span<const std::byte> bytes) noexcept override {
    return guarded([&] {
      return offers_least() ? MapWriter::attach(name, bytes) : attach_checked(name, bytes);
    });
  }
  [[nodiscard]] Result<void> commit() && noexcept override {
    return guarded([&]() -> Result<void> {
      if (committed_) return {};
      if (breaks("S9")) {
        for (std::uint32_t r = 0; r < regions_; ++r) {
          if (!put_.contains(r)) VANTAGE_CHECK(sound_->put(RegionId{r}, {}));
        }
      }
      VANTAGE_CHECK(std::move(*sound_).commit());
      if (breaks("S14")) {
        std::ofstream(folder_ / "history.txt") << "region " << last_put_ << " came last\n";
      }
      if (breaks("S28")) {
        const int threads = tbb::this_task_arena::max_concurrency();
        std::ofstream(folder_ / "history.txt") << "by " << threads << " threads\n";
      }
      return {};
    });
  }

 private:
  [[nodiscard]] Result<void> put_checked(RegionId region, RegionMap map) {
    PointCloud& points = map.points;
    if (breaks("S7")) std::erase_if(points, [](const Point& p) { return !p.allFinite(); });
    if (breaks("S1")) {  // single precision, of absolute coordinates
      for (Point& p : points) p = p.cast<float>().cast<double>();
    }
    if (breaks("S11")) points.erase(std::unique(points.begin(), points.end()), points.end());
    if (breaks("S15")) {  // in words
      auto& bytes = map.prepared.bytes;
      bytes.resize((bytes.size() + 3) / 4 * 4);
    }
    if (breaks("S16")) {  // in a byte
      for (std::uint32_t& views : map.views) views = std::min(views, 255U);
    }
    if (breaks("S8") && put_.contains(region.value)) return {};
    VANTAGE_CHECK(sound_->put(region, map));
    put_.insert(region.value);
    last_put_ = region.value;
    if (breaks("S2") && put_.size() == regions_) {
      committed_ = true;
      return std::move(*sound_).commit();
    }
    return {};
  }

  [[nodiscard]] Result<void> attach_checked(std::string_view name,
                                            std::span<const std::byte> bytes) {
    if (breaks("S17")) {  // as a C string
      bytes = bytes.first(std::size_t(std::ranges::find(bytes, std::byte{0}) - bytes.begin()));
    }
    if (breaks("S18") && name.find('_') != std::string_view::npos) {
      return fail(ErrorCode::unsupported, "a name has letters only");
    }
    if (breaks("S23")) std::ofstream(folder_ / name) << "attached";
    auto done = sound_->attach(name, bytes);
    if (done) return done;
    if (breaks("S20") && done.error().code == ErrorCode::already_exists) return {};
    if (breaks("S22") && done.error().code == ErrorCode::invalid_input) return {};
    return done;
  }

  std::shared_ptr<const MapStore> store_;  // keeps the library of `sound_`
  std::unique_ptr<MapWriter> sound_;
  std::size_t regions_;
  fs::path folder_;  // of the bundle's folder
  std::set<std::uint32_t> put_;
  std::uint32_t last_put_ = 0;
  bool committed_ = false;
};

class Broken final : public MapStore {
 public:
  struct Params {
    fs::path root;
    static constexpr auto schema() {
      return std::tuple{required("root", &Params::root, "", "folder of the bundle")};
    }
  };
  static Result<std::unique_ptr<MapStore>> create(const Params& params) {
    Table table;
    table.entries.push_back({"root", Value{params.root.string(), {}}, {}});
    if (breaks("S4")) table.entries.push_back({"overwrite", Value{true, {}}, {}});
    VANTAGE_TRY(auto sound_store, sound<MapStore>("pcd_tiles", table));
    return std::make_unique<Broken>(std::move(sound_store), params.root);
  }
  Broken(PluginPtr<MapStore> sound, fs::path root)
      : sound_(std::move(sound)), root_(std::move(root)) {}

  [[nodiscard]] Result<void> may_begin() const noexcept override {
    return guarded([&]() -> Result<void> {
      if (breaks("S27")) return fail(ErrorCode::unsupported, "it only reads");
      // It tries whether a folder can be made.
      if (breaks("S26")) fs::create_directories(root_);
      return sound_->may_begin();
    });
  }
  [[nodiscard]] Result<std::unique_ptr<MapWriter>> begin(
      const MapIndex& index) const noexcept override {
    return guarded([&] { return begin_with(index); });
  }
  [[nodiscard]] Result<std::unique_ptr<const MapReader>> open() const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<const MapReader>> {
      auto reader = sound_->open();
      if (reader) return std::make_unique<const BrokenReader>(sound_, *std::move(reader));
      if (breaks("S13") && reader.error().code == ErrorCode::not_found) {
        return fail(ErrorCode::io_failure, "index.json: no such file");
      }
      return fail(std::move(reader).error());
    });
  }

 private:
  [[nodiscard]] Result<std::unique_ptr<MapWriter>> begin_with(MapIndex index) const {
    if (breaks("S10")) {  // edges with six decimals
      std::vector<Region> regions = index.partition.regions();
      for (Region& region : regions) {
        if (auto* box = std::get_if<HalfOpenBox>(&region.footprint); box && box->max.x() > 1.0) {
          box->max = (box->max * 1e6).array().round() / 1e6;
        }
      }
      VANTAGE_TRY(index.partition, Partition::from(std::move(regions)));
    }
    VANTAGE_TRY(auto writer, sound_->begin(index));
    return std::make_unique<BrokenWriter>(sound_, std::move(writer), index.partition.size(),
                                          root_.parent_path());
  }

  std::shared_ptr<const MapStore> sound_;
  fs::path root_;
};

}  // namespace
}  // namespace vantage::broken

VANTAGE_BROKEN_PLUGIN(vantage::MapStore);
