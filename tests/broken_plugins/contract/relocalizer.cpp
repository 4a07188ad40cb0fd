// voxel_search, but for the clause to be broken.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "breaks.hpp"

namespace vantage::broken {
namespace {

using Bytes = std::vector<std::byte>;

Result<PluginPtr<RelocalizerIndex>> open_sound(const PluginPtr<Relocalizer>& relocalizer,
                                               std::span<const std::byte> bytes) {
  VANTAGE_TRY(auto index, relocalizer->open(bytes));
  return in_library_of(relocalizer, std::move(index));
}

class BrokenIndex final : public RelocalizerIndex {
 public:
  /// @param sound  none: nothing is found
  /// @param bytes  borrowed, which is what R5 is about
  BrokenIndex(PluginPtr<Relocalizer> relocalizer, PluginPtr<RelocalizerIndex> sound,
              std::span<const std::byte> bytes)
      : relocalizer_(std::move(relocalizer)), sound_(std::move(sound)), bytes_(bytes) {}

  [[nodiscard]] Result<PoseCandidates> find(PointsView scan,
                                            const PlaceQuery& asked) const noexcept override {
    return guarded([&]() -> Result<PoseCandidates> {
      if (!sound_) return PoseCandidates{};
      std::optional<Crowded> here;  // before the search, as searches end at different times
      if (breaks("R7")) here.emplace(inside_);
      PlaceQuery query = asked;
      if (breaks("R10") && query.up) query.up = Eigen::Vector3d::UnitZ();
      if (breaks("R11") && !query.up) query.up = Eigen::Vector3d::UnitZ();
      if (breaks("R13")) query.stop = {};
      PointCloud finite(scan.begin(), scan.end());
      if (breaks("R14")) std::erase_if(finite, [](const Point& p) { return !p.allFinite(); });
      VANTAGE_TRY(PoseCandidates found, search(finite, query));
      if (breaks("R3") && found.poses.empty()) {
        query.area = {};
        VANTAGE_TRY(found, search(finite, query));
      }
      if (breaks("R2")) std::ranges::reverse(found.poses);
      if (here && *here && !found.poses.empty()) found.poses[0].score += 1e-9;
      if (breaks("R8") && !is_first(finite) && !found.poses.empty()) found.poses.pop_back();
      if (breaks("R16") && threads_are_unusual() && !found.poses.empty()) found.poses.pop_back();
      if (breaks("R12")) found.nominal_ms = 0.0;
      for (PoseCandidate& candidate : found.poses) {
        Point& at = candidate.T_map_scan.translation;
        // Everywhere at once, with coarser cells.
        if (breaks("R1") && std::isinf(query.area.radius) && query.up == Eigen::Vector3d::UnitZ() &&
            at.norm() < 1e5) {
          at.x() += 4.0;
        }
        // Millimetres in 32 bits.
        if (breaks("R9")) {
          for (double& x : at) {
            x = static_cast<std::int32_t>(static_cast<std::int64_t>(std::llround(1e3 * x))) / 1e3;
          }
        }
      }
      return found;
    });
  }
  [[nodiscard]] std::size_t bytes() const noexcept override {
    return breaks("R17") || !sound_ ? sizeof(*this) : sound_->bytes();
  }

 private:
  [[nodiscard]] Result<PoseCandidates> search(PointsView scan, const PlaceQuery& query) const {
    if (!breaks("R5")) return sound_->find(scan, query);
    VANTAGE_TRY(const auto late, open_sound(relocalizer_, bytes_));
    return late->find(scan, query);
  }

  /// Keeps something of the first scan that it is ever asked about.
  [[nodiscard]] bool is_first(PointsView scan) const {
    const std::scoped_lock lock(mutex_);
    if (scan.empty()) return true;
    if (!first_) first_ = scan.front();
    return *first_ == scan.front();
  }

  PluginPtr<Relocalizer> relocalizer_;
  PluginPtr<RelocalizerIndex> sound_;
  std::span<const std::byte> bytes_;
  mutable std::atomic<int> inside_ = 0;
  mutable std::mutex mutex_;
  mutable std::optional<Point> first_;
};

class Broken final : public Relocalizer {
 public:
  using Params = OneParam;
  static Result<std::unique_ptr<Relocalizer>> create(const Params& /*params*/) {
    return std::make_unique<Broken>();
  }

  [[nodiscard]] Result<Bytes> index(const MapPasses& map) const noexcept override {
    return guarded([&]() -> Result<Bytes> {
      if (breaks("R15") && map.points() == 0) return Bytes(1);
      VANTAGE_TRY(const auto relocalizer, sound<Relocalizer>("voxel_search", {}));
      VANTAGE_TRY(Bytes bytes, relocalizer->index(map));
      if (!breaks("R4")) return bytes;
      // The number of the parts in which the map came.
      class Count final : public MapVisitor {
       public:
        [[nodiscard]] Result<void> see(PointsView /*points*/) noexcept override {
          ++parts;
          return {};
        }
        std::size_t parts = 0;
      } count;
      VANTAGE_CHECK(map.pass(count));
      bytes.insert(bytes.begin(), static_cast<std::byte>(count.parts & 255U));
      return bytes;
    });
  }

  [[nodiscard]] Result<std::unique_ptr<RelocalizerIndex>> open(
      std::span<const std::byte> bytes) const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<RelocalizerIndex>> {
      if (breaks("R4")) bytes = bytes.subspan(std::min<std::size_t>(1, bytes.size()));
      VANTAGE_TRY(auto relocalizer, sound<Relocalizer>("voxel_search", {}));
      auto index = open_sound(relocalizer, bytes);
      if (!index && !breaks("R6")) return fail(std::move(index).error());
      auto opened = index ? *std::move(index) : PluginPtr<RelocalizerIndex>();
      return std::make_unique<BrokenIndex>(std::move(relocalizer), std::move(opened), bytes);
    });
  }
};

}  // namespace
}  // namespace vantage::broken

VANTAGE_BROKEN_PLUGIN(vantage::Relocalizer);
