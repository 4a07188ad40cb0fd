#include "build/parts.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>
#include <utility>

#include "bundle/predicted_error_bytes.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

// The last two characters are the version. The key follows.
constexpr std::string_view kPartsFormat = "vparts05";
constexpr std::uint64_t kHead = kPartsFormat.size() + sizeof(std::uint64_t);
// Region, size of the content, checksum of all three.
constexpr std::uint64_t kRecordHead = 3 * sizeof(std::uint64_t);

tl::unexpected<Error> parts_error(ErrorCode code, std::string message, const fs::path& file) {
  return fail(code, std::move(message), SourceLocation{file.string(), 0, 0});
}

/// Of all that a record says: a content under the number of another region is damage, too.
std::uint64_t sum_of_record(std::uint64_t region, std::span<const std::byte> bytes) {
  Checksum sum;
  sum.add(region);
  sum.add(std::uint64_t{bytes.size()});
  sum.add(bytes);
  return sum.value();
}

template <class Archive, class Part>
void describe_part(Archive& archive, Part& part) {
  auto& region = part.region;
  archive.field(region.seen);
  archive.field(region.skipped);
  archive.field(region.points);
  std::uint64_t next = 0;  // ranks ascend, so their steps are short
  archive.list(part.ranks, 1, [&](auto& rank) {
    std::uint64_t step = rank - next;
    archive.counted(step);
    if constexpr (Archive::kReads) rank = next + step;
    archive.check(rank >= next && rank < ~std::uint64_t{0});
    next = rank + 1;
  });
  auto& counts = region.stored.views;
  archive.list(counts, 1, [&](auto& views) { archive.counted(views); });
  archive.check(counts.empty() || counts.size() == part.ranks.size());
  archive.field(region.prepared.elements);
  archive.field(region.prepared.bytes);
  describe_errors(archive, region.errors);
}

bool decode(ByteReader from, StoredPart& part) {
  describe_part(from, part);
  return from.ok() && from.left() == 0;
}

Result<void> check_head(const io::InputFile& file, std::uint64_t key) {
  std::array<char, kHead> head{};
  VANTAGE_CHECK(file.read(0, head));
  ByteReader from(std::as_bytes(std::span(head)));
  if (from.raw(kPartsFormat.size()) != kPartsFormat) {
    return parts_error(ErrorCode::corrupt_data, "this is not a file of parts of this version",
                       file.name());
  }
  if (from.number<std::uint64_t>() == key) return {};
  return parts_error(
      ErrorCode::already_exists,
      "these are parts of another build: keep those of this build in another folder, "
      "or remove these",
      file.name());
}

struct Record {
  std::uint64_t region = 0, size = 0, sum = 0;
};

Result<Record> record_at(const io::InputFile& file, std::uint64_t offset) {
  std::array<char, kRecordHead> head{};
  VANTAGE_CHECK(file.read(offset, head));
  ByteReader from(std::as_bytes(std::span(head)));
  const auto region = from.number<std::uint64_t>(), size = from.number<std::uint64_t>();
  return Record{region, size, from.number<std::uint64_t>()};
}

/// Calls visit(record, offset of its content) for all whole records.
/// @return  where they end
template <class Visit>
Result<std::uint64_t> walk(const io::InputFile& file, const Visit& visit) {
  std::uint64_t at = kHead;
  while (at + kRecordHead <= file.size()) {
    VANTAGE_TRY(const Record record, record_at(file, at));
    // A size of 0 is that of a region whose head was not written any more.
    if (record.size == 0 || record.size > file.size() - at - kRecordHead) break;
    visit(record, at + kRecordHead);
    at += kRecordHead + record.size;
  }
  return at;
}

Result<void> write_all(const io::Descriptor& file, std::span<const std::byte> bytes,
                       std::uint64_t offset, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written =
        ::pwrite(file.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return io::system_error(path, "the file cannot be written", errno);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
  return {};
}

Result<void> flush(const io::Descriptor& file, const fs::path& path) {
  const int reason = io::flush_content(file);
  if (reason == 0) return {};
  return io::system_error(path, "the file cannot be written to the disk", reason);
}

constexpr std::string_view kPrefix = "shard_", kExtension = ".parts";

/// The n-th file of a shard, from 1 on: "shard_1_of_2.parts", "shard_1_of_2-2.parts".
std::string file_of(const Shard& shard, unsigned n) {
  std::string name =
      std::string(kPrefix) + std::to_string(shard.number) + "_of_" + std::to_string(shard.count);
  if (n > 1) name += "-" + std::to_string(n);
  return name + std::string(kExtension);
}

std::vector<std::byte> head_of_file(std::uint64_t key) {
  ByteWriter head;
  head.raw(kPartsFormat);
  head.number(key);
  return std::move(head).take();
}

/// A lock tells that a process is at work. It only saves work: where locks do not work, as on some
/// network file systems, several processes build the same regions, each into its own file.
Result<void> check_idle(const fs::path& file) {
  const io::Descriptor other = io::Descriptor::of(file, O_RDWR);
  if (!other.open() || io::lock_file(other, io::Wait::no) != EWOULDBLOCK) return {};
  return parts_error(ErrorCode::already_exists, "another process is building this shard", file);
}

/// Whether a process was stopped before it had written the head of its file.
Result<bool> is_begun(const io::InputFile& file, std::uint64_t key) {
  std::vector<char> bytes(file.size());
  VANTAGE_CHECK(file.read(0, bytes));
  const std::vector<std::byte> head = head_of_file(key);
  return std::ranges::equal(std::as_bytes(std::span(bytes)), std::span(head).first(bytes.size()));
}

}  // namespace

std::vector<std::uint64_t> ranks_of(const MapPart& part, const IndexList& points) {
  const std::vector<MapPart::Run>& runs = part.runs();
  std::vector<std::uint64_t> ranks;
  ranks.reserve(points.size());
  std::size_t run = 0;
  for (const std::uint32_t k : points) {
    while (run + 1 < runs.size() && runs[run + 1].begin <= k) ++run;
    ranks.push_back(runs[run].rank + (k - runs[run].begin));
  }
  return ranks;
}

Result<IndexList> indices_of(const MapPart& part, const std::vector<std::uint64_t>& ranks) {
  const std::vector<MapPart::Run>& runs = part.runs();
  const std::size_t size = part.points().size();
  IndexList points;
  points.reserve(ranks.size());
  std::size_t run = 0;
  for (const std::uint64_t rank : ranks) {
    while (run + 1 < runs.size() && runs[run + 1].rank <= rank) ++run;
    const std::uint64_t k = runs.empty() ? size : runs[run].begin + rank - runs[run].rank;
    const std::size_t end = run + 1 < runs.size() ? runs[run + 1].begin : size;
    if (k >= end || rank < runs[run].rank) {
      return fail(ErrorCode::internal, "a part of the map lacks a point that a region has");
    }
    points.push_back(static_cast<std::uint32_t>(k));
  }
  return points;
}

PartWriter::PartWriter(PartWriter&& other) noexcept
    : path_(std::exchange(other.path_, {})), file_(std::move(other.file_)), end_(other.end_) {}

PartWriter::~PartWriter() {
  if (!path_.empty() && end_ == kHead) ::unlink(path_.c_str());
}

Result<PartWriter> PartWriter::create(const fs::path& folder, const Shard& shard,
                                      std::uint64_t key) {
  PartWriter writer;
  fs::path file;
  for (unsigned n = 1; !writer.file_.open(); ++n) {
    file = folder / file_of(shard, n);
    writer.file_ = io::Descriptor::of(file, O_RDWR | O_CREAT | O_EXCL);
    if (writer.file_.open()) break;
    if (errno != EEXIST) return io::system_error(file, "the file cannot be created", errno);
    VANTAGE_CHECK(check_idle(file));
  }
  writer.path_ = std::move(file);
  writer.end_ = kHead;
  (void)io::lock_file(writer.file_, io::Wait::no);
  VANTAGE_CHECK(write_all(writer.file_, head_of_file(key), 0, writer.path_));
  return writer;
}

Result<void> PartWriter::add(std::uint32_t region, const StoredPart& part) {
  ByteWriter described;
  describe_part(described, part);
  const std::vector<std::byte> content = std::move(described).take();
  ByteWriter head;
  head.number(std::uint64_t{region});
  head.number(std::uint64_t{content.size()});
  head.number(sum_of_record(region, content));
  // The head comes last, when the content is on the disk: without it the content is not there.
  auto written = write_all(file_, content, end_ + kRecordHead, path_);
  if (written) written = flush(file_, path_);
  if (written) written = write_all(file_, std::move(head).take(), end_, path_);
  if (!written) {
    if (::ftruncate(file_.get(), static_cast<off_t>(end_)) != 0) {
      // What is left over is no whole region.
    }
    return written;
  }
  end_ += kRecordHead + content.size();
  return {};
}

Result<void> PartWriter::finish() && {
  if (end_ == kHead) return {};
  const fs::path path = std::exchange(path_, {});
  VANTAGE_CHECK(flush(file_, path));
  if (const int reason = file_.finish(); reason != 0) {
    return io::system_error(path, "the file cannot be written to the disk", reason);
  }
  return io::flush_name(path);
}

Result<Parts> Parts::in(const fs::path& folder, std::uint64_t key, std::size_t regions) {
  Parts parts;
  parts.places_.resize(regions);
  VANTAGE_TRY(const auto names, io::names_in(folder));
  for (const std::string& name : names) {
    if (!name.starts_with(kPrefix) || !name.ends_with(kExtension)) continue;
    auto opened =
        io::InputFile::open(folder / name, "parts of a build", io::InputFile::Empty::accept);
    // Another process has removed its file since it was listed: there was no region in it.
    if (!opened && opened.error().code == ErrorCode::not_found) continue;
    VANTAGE_TRY(const io::InputFile file, std::move(opened));
    if (file.size() < kHead) {
      VANTAGE_TRY(const bool begun, is_begun(file, key));
      if (begun) parts.files_.push_back(folder / name);
      continue;
    }
    VANTAGE_CHECK(check_head(file, key));
    const auto f = static_cast<std::uint32_t>(parts.files_.size());
    parts.files_.push_back(folder / name);
    VANTAGE_CHECK(walk(file, [&](const Record& record, std::uint64_t offset) {
      if (record.region >= regions) return;
      parts.places_[record.region] = {static_cast<std::uint32_t>(record.region), f, offset,
                                      record.size};
    }));
  }
  return parts;
}

std::size_t Parts::missing() const noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(places_, [](const PartPlace& place) { return place.size == 0; }));
}

Result<StoredPart> Parts::read(std::uint32_t region) const {
  const PartPlace& place = places_[region];
  const fs::path& path = files_[place.file];
  VANTAGE_TRY(const io::InputFile file, io::InputFile::open(path, "parts of a build"));
  VANTAGE_TRY(const Record record, record_at(file, place.offset - kRecordHead));
  std::vector<std::byte> bytes(place.size);
  VANTAGE_CHECK(file.read(place.offset, {reinterpret_cast<char*>(bytes.data()), bytes.size()}));
  StoredPart part;
  const bool is_whole = record.region == region && record.sum == sum_of_record(region, bytes);
  if (is_whole && decode(ByteReader(bytes), part)) return part;
  return parts_error(ErrorCode::corrupt_data,
                     "region " + std::to_string(region) +
                         " is damaged: remove this file and build its shard again",
                     path);
}

}  // namespace vantage
