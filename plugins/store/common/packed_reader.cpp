#include <algorithm>
#include <utility>

#include "common/packed_index.hpp"
#include "common/packed_pages.hpp"

namespace vantage::bundle_folder {
namespace {

using namespace packed;  // NOLINT(google-build-using-namespace)

constexpr std::uint64_t kKnownVersion = 1;

/// Takes numbers from the front of an entry. After one that is not there, it is not `ok`.
class EntryReader {
 public:
  explicit EntryReader(std::string_view bytes) noexcept : bytes_(bytes) {}
  [[nodiscard]] bool at_end() const noexcept { return ok_ && bytes_.empty(); }
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  std::string_view take(std::size_t size) noexcept {
    if (size > bytes_.size()) ok_ = false;
    if (!ok_) return {};
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }
  template <class T>
  T number() noexcept {
    const std::string_view bytes = take(sizeof(T));
    return bytes.empty() ? T{} : packed::get<T>(bytes.data());
  }
  /// Of things that follow, each of so many bytes.
  std::uint32_t count(std::size_t size) noexcept {
    const auto n = number<std::uint32_t>();
    if (n > bytes_.size() / size) ok_ = false;
    return ok_ ? n : 0;
  }
  Eigen::Vector2d xy() noexcept {
    const auto x = number<double>(), y = number<double>();
    return {x, y};
  }
  HalfOpenBox box() noexcept {
    const Eigen::Vector2d min = xy(), max = xy();
    return {min, max};
  }
  Footprint footprint() {
    const auto kind = number<std::uint32_t>();
    if (kind == 0) return box();
    if (kind == 1) {
      ConvexPolygon polygon;
      for (std::uint32_t n = count(16); n > 0; --n) polygon.corners.push_back(xy());
      return polygon;
    }
    BoxUnion all;
    if (kind != 2) ok_ = false;
    for (std::uint32_t n = count(32); n > 0; --n) all.boxes.push_back(box());
    return all;
  }

 private:
  std::string_view bytes_;
  bool ok_ = true;
};

bool meets(const Child& child, const Bounds2& area) noexcept {
  const auto& [x0, y0, x1, y1] = child.box;
  return x0 <= area.max.x() && area.min.x() <= x1 && y0 <= area.max.y() && area.min.y() <= y1;
}

}  // namespace

Result<PackedIndex> PackedIndex::open(const std::filesystem::path& path) {
  VANTAGE_TRY(io::InputFile file, io::InputFile::open(path, "the regions of a bundle"));
  PackedIndex index(std::move(file));
  const std::uint64_t size = index.file_.size();
  if (size % kPage != 0) {
    return index.corrupt("the file has " + std::to_string(size) +
                         " bytes, expected pages of 4096: it is cut off");
  }
  Page page;
  VANTAGE_CHECK(index.read_page(size / kPage - 1, page));
  const auto last = packed::get<Summary>(page.data());
  if (last.title != kTitle || last.version != kKnownVersion) {
    return index.corrupt(
        "the file does not hold the regions of a bundle, or is of a later version");
  }
  const std::uint64_t pages = size / kPage - 1;
  const bool sound = last.regions > 0 && last.regions < 0xffff'ffffU && last.pages == pages &&
                     last.entries_bytes <= size && last.first_offsets <= last.root &&
                     last.root < last.first_labels && last.first_labels < pages &&
                     pages_for(last.regions + 1, kOffsets) <= pages - last.first_offsets &&
                     pages_for(last.regions, kLabels) <= pages - last.first_labels;
  if (!sound) return index.corrupt("the last page contradicts itself");
  index.totals_ = {.regions = last.regions,
                   .empty = last.empty,
                   .without_points = last.without_points,
                   .least_points = last.least_points,
                   .most_points = last.most_points,
                   .points = last.points,
                   .viewpoints = last.viewpoints,
                   .elements = last.elements,
                   .bytes = last.bytes,
                   .max_views = last.max_views,
                   .extent = {{last.extent[0], last.extent[1]}, {last.extent[2], last.extent[3]}}};
  index.checksum_ = packed::get<std::uint64_t>(page.data() + kContent);
  index.entries_bytes_ = last.entries_bytes;
  index.first_offsets_ = last.first_offsets;
  index.root_ = last.root;
  index.first_labels_ = last.first_labels;
  return index;
}

Result<void> PackedIndex::read_page(std::uint64_t page, Page& into) const {
  VANTAGE_CHECK(file_.read(page * kPage, into));
  if (packed::get<std::uint64_t>(into.data() + kContent) == sum_of_page(into.data(), page)) {
    return {};
  }
  return corrupt("page " + std::to_string(page) + " does not have its checksum: it is damaged");
}

Result<std::uint64_t> PackedIndex::offset_of(std::uint64_t region) const {
  Page page;
  VANTAGE_CHECK(read_page(first_offsets_ + region / kOffsets, page));
  return packed::get<std::uint64_t>(page.data() + region % kOffsets * sizeof(std::uint64_t));
}

Result<IndexedRegion> PackedIndex::entry(std::uint32_t region) const {
  VANTAGE_TRY(const std::uint64_t begin, offset_of(region));
  VANTAGE_TRY(const std::uint64_t end, offset_of(region + std::uint64_t{1}));
  if (end < begin || end > entries_bytes_) return corrupt("the table of entries is damaged");
  std::string bytes(end - begin, '\0');
  VANTAGE_CHECK(file_.read(begin, bytes));
  return decode(bytes, region, begin);
}

Result<IndexedRegion> PackedIndex::decode(std::string_view bytes, std::uint32_t region,
                                          std::uint64_t offset) const {
  const auto damaged = [&] {
    return corrupt("the entry of region " + std::to_string(region) + " at byte " +
                   std::to_string(offset) + " is damaged");
  };
  if (bytes.size() < sizeof(std::uint64_t)) return damaged();
  const std::string_view content = bytes.substr(0, bytes.size() - sizeof(std::uint64_t));
  Fnv1a sum;
  sum.add(content);
  if (packed::get<std::uint64_t>(bytes.data() + content.size()) != sum.value()) return damaged();
  EntryReader reader(content);
  if (reader.number<std::uint32_t>() != region) return damaged();
  IndexedRegion found;
  found.region.label = reader.take(reader.count(1));
  found.region.footprint = reader.footprint();
  const Eigen::Vector2d height = reader.xy();
  found.region.height = {height[0], height[1]};
  RegionFile& file = found.file;
  for (std::uint64_t* const count : {&file.points, &file.viewpoints, &file.elements,
                                     &file.prepared_bytes, &file.bytes, &file.checksum}) {
    *count = reader.number<std::uint64_t>();
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) file.origin[axis] = reader.number<double>();
  file.max_views = reader.number<std::uint32_t>();
  if (!reader.at_end() || !file.origin.allFinite() || file.points > kMaxPoints ||
      file.viewpoints > kMaxPoints || file.prepared_bytes > kMaxPreparedBytes) {
    return damaged();
  }
  return found;
}

Result<std::vector<RegionId>> PackedIndex::meeting(const Bounds2& area) const {
  std::vector<RegionId> found;
  std::vector<std::uint64_t> open{root_};
  Page page;
  while (!open.empty()) {
    const std::uint64_t number = open.back();
    open.pop_back();
    VANTAGE_CHECK(read_page(number, page));
    const auto node = packed::get<Node>(page.data());
    if (node.children > kChildren) return corrupt("a page of the tree is damaged");
    for (std::size_t k = 0; k < node.children; ++k) {
      const auto child = packed::get<Child>(page.data() + sizeof(Node) + k * sizeof(Child));
      if (!meets(child, area)) continue;
      if (node.level == 0) {
        if (child.number >= totals_.regions) return corrupt("a page of the tree is damaged");
        found.push_back(RegionId{child.number});
      } else {
        // Children come before their parents: this ends.
        if (child.number >= number) return corrupt("a page of the tree is damaged");
        open.push_back(child.number);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

Result<std::optional<RegionId>> PackedIndex::find(std::string_view label) const {
  const std::uint64_t wanted = hash_of_label(label);
  Page page;
  std::uint64_t in_page = ~std::uint64_t{0};
  const auto at = [&](std::uint64_t k) -> Result<Label> {
    if (k / kLabels != in_page) {
      in_page = k / kLabels;
      VANTAGE_CHECK(read_page(first_labels_ + in_page, page));
    }
    return packed::get<Label>(page.data() + k % kLabels * sizeof(Label));
  };
  std::uint64_t low = 0, high = totals_.regions;
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    VANTAGE_TRY(const Label here, at(middle));
    (here.hash < wanted ? low : high) = here.hash < wanted ? middle + 1 : middle;
  }
  for (; low < totals_.regions; ++low) {
    VANTAGE_TRY(const Label here, at(low));
    if (here.hash != wanted) break;
    if (here.region >= totals_.regions) return corrupt("a page of labels is damaged");
    VANTAGE_TRY(const IndexedRegion region, entry(here.region));
    if (region.region.label == label) return RegionId{here.region};
  }
  return std::nullopt;
}

Result<std::vector<IndexedRegion>> PackedIndex::all() const {
  std::vector<IndexedRegion> regions;
  regions.reserve(totals_.regions);
  for (std::uint32_t r = 0; r < totals_.regions; ++r) {
    VANTAGE_TRY(IndexedRegion region, entry(r));
    regions.push_back(std::move(region));
  }
  return regions;
}

tl::unexpected<Error> PackedIndex::corrupt(const std::string& reason) const {
  return fail(ErrorCode::corrupt_data, reason, SourceLocation{file_.name(), 0, 0});
}

}  // namespace vantage::bundle_folder
