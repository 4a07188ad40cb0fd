#include "bundle_targets.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <span>
#include <string>

#include "build/parts.hpp"
#include "build/plan_file.hpp"
#include "common/bundle_head.hpp"
#include "common/packed_index.hpp"
#include "pcd_tiles/format.hpp"
#include "shared_tiles/bytes.hpp"
#include "shared_tiles/region_reader.hpp"
#include "support/real_data.hpp"
#include "targets.hpp"
#include "vantage/io/tiled_map.hpp"
#include "vantage/kit/checksum.hpp"

namespace vantage::test::bundle_targets {
namespace {

using Outcome = std::optional<Error>;
using bundle_folder::RegionFile, pcd_tiles::kFormat;
namespace fs = std::filesystem;
namespace packed = bundle_folder::packed;

const SourceLocation kWhere{kFuzzedFile, 0, 0};

template <class T>
Outcome outcome_of(const Result<T>& result) {
  if (result) return std::nullopt;
  return result.error();
}

/// An error of a function that does not know where its bytes come from.
template <class T>
Outcome outcome_in_input(const Result<T>& result) {
  if (result) return std::nullopt;
  Error error = result.error();
  error.where = kWhere;
  return error;
}

Outcome too_short() { return Error{ErrorCode::corrupt_data, "too short", kWhere, {}}; }

template <class T>
T word_at(std::string_view bytes, std::size_t at) {
  T word;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

template <class T>
void put_at(std::string& bytes, std::size_t at, const T& word) {
  std::memcpy(bytes.data() + at, &word, sizeof word);
}

/// Takes so many bytes from the front, or what there is.
std::string_view take(std::string_view& from, std::size_t size) {
  const std::string_view taken = from.substr(0, size);
  from.remove_prefix(taken.size());
  return taken;
}

std::string_view take_sized(std::string_view& from) {
  if (from.size() < 4) return {};
  return take(from, word_at<std::uint32_t>(take(from, 4), 0));
}

/// A file whose path has the name of the input. It is replaced by each input.
fs::path file_of(const std::string& name, std::string_view content) {
  static const TemporaryFolder folder;
  const fs::path path = folder.path() / kFuzzedFile;
  fs::create_directory(path);
  std::ofstream(path / name, std::ios::binary)
      .write(content.data(), static_cast<std::streamsize>(content.size()));
  return path / name;
}

std::string sealed_regions(std::string_view input) {
  using namespace packed;  // NOLINT(google-build-using-namespace)
  std::string bytes(input);
  const std::uint64_t pages = bytes.size() / kPage;
  if (pages == 0 || bytes.size() % kPage != 0) return bytes;
  const auto last = word_at<Summary>(bytes, (pages - 1) * kPage);
  const std::uint64_t first = pages_for(last.entries_bytes, kPage);
  Checksum content;
  for (std::uint64_t r = 0; r < last.regions; ++r) {
    const auto offset = [&](std::uint64_t k) {
      return (first + k / kOffsets) * kPage + k % kOffsets * 8;
    };
    if (first >= pages || offset(r + 1) + 8 > bytes.size()) break;
    const auto begin = word_at<std::uint64_t>(bytes, offset(r));
    const auto end = word_at<std::uint64_t>(bytes, offset(r + 1));
    if (begin > end || end > bytes.size() || end - begin < 8) break;
    const auto entry = std::string_view(bytes).substr(begin, end - begin - 8);
    const std::uint64_t sum = checksum_of(entry);
    put_at(bytes, end - 8, sum);
    content.add(sum);
  }
  for (std::uint64_t k = std::min(first, pages - 1); k < pages; ++k) {
    if (k + 1 == pages) put_at(bytes, k * kPage + offsetof(Summary, content), content.value());
    const std::uint64_t sum = sum_of_page(bytes.data() + k * kPage, k);
    put_at(bytes, k * kPage + kContent, sum);
    content.add(sum);
  }
  return bytes;
}

/// A record's number and size, and its content.
std::uint64_t sum_of_record(std::string_view head, std::string_view content) {
  Checksum sum;
  sum.add(word_at<std::uint64_t>(head, 0));
  sum.add(word_at<std::uint64_t>(head, 8));
  sum.add(content);
  return sum.value();
}

std::optional<RegionFile> region_file(std::string_view& input) {
  if (input.size() < sizeof(RegionCounts)) return std::nullopt;
  const auto counts = word_at<RegionCounts>(take(input, sizeof(RegionCounts)), 0);
  RegionFile file{.points = counts.points,
                  .viewpoints = counts.viewpoints,
                  .elements = counts.elements,
                  .prepared_bytes = counts.prepared_bytes,
                  .origin = {counts.origin[0], counts.origin[1], counts.origin[2]},
                  .max_views = static_cast<std::uint32_t>(counts.max_views)};
  // What the readers of an index let through.
  const bool may_be = file.points <= bundle_folder::kMaxPoints &&
                      file.viewpoints <= bundle_folder::kMaxPoints &&
                      file.prepared_bytes <= bundle_folder::kMaxPreparedBytes &&
                      (file.max_views == 0 || file.points > 0) && file.origin.allFinite();
  if (!may_be) return std::nullopt;
  return file;
}

/// Gives each part of a region the checksum of the bytes that it names.
std::string with_sums_of_tiles(std::string content, const RegionFile& file,
                               std::string_view tiles) {
  const std::uint64_t width = file.max_views == 0        ? 0
                              : file.max_views <= 0xff   ? 1
                              : file.max_views <= 0xffff ? 2
                                                         : 4;
  std::uint64_t at = 32 + 12 * file.viewpoints + width * file.points + file.prepared_bytes;
  at = (at + 7) / 8 * 8;
  if (at > content.size() || content.size() - at < 16) return content;
  const auto count = word_at<std::uint64_t>(content, at);
  at += 16;
  for (std::uint64_t k = 0; k < count && content.size() - at >= 40; ++k, at += 40) {
    const auto offset = word_at<std::uint64_t>(content, at);
    const auto bytes = word_at<std::uint64_t>(content, at + 8);
    if (offset > tiles.size() || bytes > tiles.size() - offset) continue;
    put_at(content, at + 16, checksum_of(tiles.substr(offset, bytes)));
  }
  return content;
}

}  // namespace

Outcome read_index(std::string_view input) {
  return outcome_of(bundle_folder::from_json(kFormat, input, kFuzzedFile));
}

Outcome read_regions(std::string_view input) {
  const std::string bytes = sealed_regions(input);
  const auto index =
      bundle_folder::PackedIndex::open(kFormat, io::InputFile::of_memory(bytes, kFuzzedFile));
  if (!index) return index.error();
  const Bounds2 everywhere{Eigen::Vector2d::Constant(-1e300), Eigen::Vector2d::Constant(1e300)};
  Outcome first;
  const auto note = [&](Outcome outcome) {
    if (!first) first = std::move(outcome);
  };
  note(outcome_of(index->meeting(everywhere)));
  note(outcome_of(index->meeting({{10.5, 10.5}, {20.0, 20.0}})));
  note(outcome_of(index->entry(0)));
  note(outcome_of(index->find("r1")));
  note(outcome_of(index->all()));
  return first;
}

Outcome read_plan(std::string_view input) {
  std::string bytes(input);
  const std::uint64_t value = checksum_of(bytes);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  return outcome_in_input(decode_plan(std::as_bytes(std::span(bytes)), kFuzzedBuild));
}

Outcome read_parts(std::string_view input) {
  constexpr std::size_t kFileHead = 16, kHead = 24;
  constexpr std::uint32_t kRegions = 3;
  std::string bytes(input);
  for (std::size_t at = kFileHead; at + kHead <= bytes.size();) {
    const auto size = word_at<std::uint64_t>(bytes, at + 8);
    if (size == 0 || size > bytes.size() - at - kHead) break;
    const std::string_view all(bytes);
    put_at(bytes, at + 16, sum_of_record(all.substr(at), all.substr(at + kHead, size)));
    at += kHead + size;
  }
  const fs::path file = file_of("shard_1_of_1.parts", bytes);
  const auto parts = Parts::in(file.parent_path(), kFuzzedKey, kRegions);
  if (!parts) return parts.error();
  for (std::uint32_t r = 0; r < kRegions; ++r) {
    if (!parts->has(r)) continue;
    if (const auto part = parts->read(r); !part) return part.error();
  }
  // What is cut off is no error of the file: it is built again.
  if (parts->missing() == 0) return std::nullopt;
  return Error{ErrorCode::not_found, "not all regions are built", kWhere, {}};
}

Outcome read_pack(std::string_view input) {
  std::string index(take_sized(input));
  const std::string_view pack = take_sized(input);
  if (index.size() >= 8 && index.size() % 8 == 0) {
    put_at(index, index.size() - 8,
           checksum_of(std::string_view(index).substr(0, index.size() - 8)));
  }
  file_of("points_0000.pack", pack);
  const fs::path folder = file_of("index.vtiles", index).parent_path();
  const auto map = io::TiledMap::open(folder);
  if (!map) return map.error();
  (void)map->runs_in({-10, -10, 10, 10});
  return outcome_of(map->read());
}

Outcome read_shared_region(std::string_view input) {
  auto file = region_file(input);
  if (!file) return too_short();
  std::string content(take_sized(input));
  content = with_sums_of_tiles(std::move(content), *file, input);
  file->bytes = content.size();
  file->checksum = checksum_of(content);
  const fs::path tiles = file_of("tiles.bin", input);
  return outcome_of(
      shared_tiles::read_region(content, *file, tiles.parent_path() / "r.region", tiles));
}

Outcome read_pcd_region(std::string_view input) {
  auto file = region_file(input);
  if (!file) return too_short();
  file->bytes = pcd_tiles::file_size(*file);
  // The checksum is over what is behind the header.
  constexpr std::string_view kHeaderEnds = "DATA binary\n";
  const std::size_t header = input.find(kHeaderEnds);
  if (header != std::string_view::npos) {
    file->checksum = checksum_of(input.substr(header + kHeaderEnds.size()));
  }
  return outcome_of(pcd_tiles::decode(input, *file, kFuzzedFile));
}

}  // namespace vantage::test::bundle_targets
