#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "scenes.hpp"
#include "temporary_folder.hpp"
#include "vantage/conformance.hpp"
#include "vantage/map_store.hpp"

/// The bundles with which the clauses test a store, and what the clauses share.
namespace vantage::conformance {

struct Bundle {
  MapIndex index;
  std::vector<RegionMap> maps;  // by RegionId
};

using Reader = PluginPtr<const MapReader>;
using Writer = PluginPtr<MapWriter>;

/// The place where one bundle is stored.
class Place {
 public:
  explicit Place(const Subject& subject) : params_(subject.params_in(folder_.path())) {}
  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_.path(); }
  [[nodiscard]] PluginPtr<MapStore> store(const Subject& subject) const;
  /// The bundle that is there; fails the clause if it cannot be opened.
  [[nodiscard]] Reader open(const Subject& subject) const;
  /// Begins a bundle; fails the clause if it cannot be begun.
  [[nodiscard]] Writer begin(const Subject& subject, const Bundle& bundle) const;

 private:
  TemporaryFolder folder_;
  Table params_;
};

[[nodiscard]] MapIndex index_of(std::vector<Region> regions);
/// Bytes of every value.
[[nodiscard]] PreparedMap some_prepared(Random& random, std::size_t bytes, std::uint64_t elements);
/// Counts up to `most`; `most` is among them unless there are no points.
[[nodiscard]] std::vector<std::uint32_t> some_views(Random& random, std::size_t points,
                                                    std::uint32_t most);
/// Three regions side by side, one of them with views.
[[nodiscard]] Bundle some_bundle(const Subject& subject);

void require(const Result<void>& done, const char* what);
void put_all(MapWriter& writer, const Bundle& bundle);
void commit(Writer writer);
/// Puts all regions and commits.
void finish(Writer writer, const Bundle& bundle);
/// Checks that a writer cannot commit.
void check_refused(Writer writer, ErrorCode code);
/// Whether the store only reads.
[[nodiscard]] bool only_reads(const Subject& subject);
/// Puts a bundle of three regions or more where `place` is: some_bundle, or the one that a store
/// which only reads claims. If it claims none, the clause does not apply.
void place_bundle(const Subject& subject, const Place& place);
[[nodiscard]] MapIndex index_in(const MapReader& reader);
[[nodiscard]] RegionMap get(const MapReader& reader, std::uint32_t region);

[[nodiscard]] bool same_bits(const Point& a, const Point& b);
[[nodiscard]] bool same(const RegionMap& a, const RegionMap& b);
[[nodiscard]] bool same(const MapIndex& a, const MapIndex& b);
/// Checks that points came back in their order, each within `precision` [m].
void check_points_kept(const PointCloud& put, const PointCloud& got, double precision);
/// Checks that these are the points and viewpoints that were put, each within `precision` [m].
void check_kept(const Bundle& bundle, const MapReader& reader, double precision);
/// Checks that these are the points and viewpoints that were put. Only S1 checks how close they
/// are.
void check_kept(const Subject& subject, const Bundle& bundle, const MapReader& reader);

/// Every file below a folder, with its content.
[[nodiscard]] std::map<std::filesystem::path, std::string> files_below(
    const std::filesystem::path& folder);
void write_file(const std::filesystem::path& path, const std::string& content);

/// A content, and how it was damaged.
struct Damaged {
  std::string how, content;
};
[[nodiscard]] std::vector<Damaged> damages(Random& random, const std::string& good);

/// Checks that each answer of a bundle's directory is an error or that of the index of the
/// undamaged bundle.
void check_directory_reads(const MapReader& reader, const MapIndex& index);
/// S25, about MapReader::directory.
void directory_agrees(const Subject& subject);
/// S27, about a store whose may_begin is `unsupported`.
void read_only_refuses(const Subject& subject);

/// S17 to S24, about attachments. To a store that keeps none, only S18 and S19 apply.
void attached_bytes(const Subject& subject);
void attach_supported(const Subject& subject);
void not_attached(const Subject& subject);
void attached_twice(const Subject& subject);
void attached_later(const Subject& subject);
void attachment_names(const Subject& subject);
void attachments_commit(const Subject& subject);
void damaged_attachments(const Subject& subject);

}  // namespace vantage::conformance
