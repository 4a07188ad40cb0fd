#include <algorithm>
#include <cstring>
#include <utility>

#include "common/packed_entry.hpp"
#include "common/packed_index.hpp"
#include "common/packed_pages.hpp"

namespace vantage::bundle_folder {
namespace {

using namespace packed;  // NOLINT(google-build-using-namespace)

using Box = std::array<double, 4>;  // least x, y, largest x, y

Box box_of(const Bounds2& bounds) noexcept {
  return {bounds.min.x(), bounds.min.y(), bounds.max.x(), bounds.max.y()};
}

bool is_box(const Box& box) noexcept { return box[0] <= box[2] && box[1] <= box[3]; }

bool meets(const Box& box, const Bounds2& area) noexcept {
  const auto& [x0, y0, x1, y1] = box;
  return x0 <= area.max.x() && area.min.x() <= x1 && y0 <= area.max.y() && area.min.y() <= y1;
}

RegionTotals totals_of(const Summary& last) {
  return {.regions = last.regions,
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
}

}  // namespace

Result<PackedIndex> PackedIndex::open(const BundleFormat& format, io::InputFile file) {
  PackedIndex index(format, std::move(file));
  const std::uint64_t size = index.file_.size();
  if (size == 0 || size % kPage != 0) {
    return index.corrupt("the file has " + std::to_string(size) +
                         " bytes, expected pages of 4096: it is cut off");
  }
  Page page;
  VANTAGE_CHECK(index.read_page(size / kPage - 1, page));
  const auto last = packed::get<Summary>(page.data());
  if (last.title != kTitle || last.version != kVersion) {
    return index.corrupt(
        "the file does not hold the regions of a bundle, or is of another version");
  }
  const bool fits = last.regions > 0 && last.regions <= kMostRegions &&
                    last.regions <= size / sizeof(Label) && last.entries_bytes <= size;
  if (fits) index.layout_ = Layout::of(last.regions, last.entries_bytes);
  if (!fits || (index.layout_.last + 1) * kPage != size || !is_box(last.extent)) {
    return index.corrupt("the last page contradicts itself");
  }
  index.totals_ = totals_of(last);
  index.checksum_ = packed::get<std::uint64_t>(page.data() + kContent);
  index.summary_ = last;
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
  VANTAGE_CHECK(read_page(layout_.first_offsets + region / kOffsets, page));
  return packed::get<std::uint64_t>(page.data() + region % kOffsets * sizeof(std::uint64_t));
}

Result<IndexedRegion> PackedIndex::entry(std::uint32_t region) const {
  VANTAGE_TRY(const std::uint64_t begin, offset_of(region));
  VANTAGE_TRY(const std::uint64_t end, offset_of(region + std::uint64_t{1}));
  if (end < begin || end > summary_.entries_bytes) {
    return corrupt("the table of entries is damaged");
  }
  std::string bytes(end - begin, '\0');
  VANTAGE_CHECK(file_.read(begin, bytes));
  return decode(bytes, region, begin);
}

Result<IndexedRegion> PackedIndex::decode(std::string_view bytes, std::uint32_t region,
                                          std::uint64_t offset) const {
  const auto damaged = [&](const std::string& how) {
    return corrupt("the entry of region " + std::to_string(region) + " at byte " +
                   std::to_string(offset) + how);
  };
  if (bytes.size() < sizeof(std::uint64_t)) return damaged(" is damaged");
  const std::string_view content = bytes.substr(0, bytes.size() - sizeof(std::uint64_t));
  if (packed::get<std::uint64_t>(bytes.data() + content.size()) != checksum_of(content)) {
    return damaged(" is damaged");
  }
  EntryReader reader(content);
  IndexedRegion found;
  const auto number = reader.get<std::uint32_t>();
  reader.check(number == region,
               [&] { return "it says that it is that of region " + std::to_string(number); });
  describe(reader, *format_, found);
  std::string defect = std::move(reader).defect();
  if (!defect.empty()) return damaged(" contradicts itself: " + defect);
  defect = defect_of(found.region);
  if (!defect.empty()) return damaged(" describes no sound region: " + defect);
  return found;
}

Result<std::vector<Child>> PackedIndex::leaves_meeting(const Bounds2& area) const {
  struct Todo {
    std::size_t level;
    std::uint64_t number;  // of the page, in its level
    Box box;               // which it must have
  };
  std::vector<Child> leaves;
  std::vector<Todo> open{{layout_.levels.size() - 1, 0, summary_.extent}};
  Page page;
  while (!open.empty()) {
    const Todo todo = open.back();
    open.pop_back();
    const Layout::Level& level = layout_.levels[todo.level];
    VANTAGE_CHECK(read_page(level.first + todo.number, page));
    const std::uint64_t first = todo.number * kChildren;
    const auto node = packed::get<Node>(page.data());
    const auto damaged = [&] {
      return corrupt("page " + std::to_string(level.first + todo.number) +
                     " of the tree contradicts the others");
    };
    if (node.children != std::min<std::uint64_t>(kChildren, level.children - first) ||
        node.level != todo.level) {
      return damaged();
    }
    Bounds2 all;
    for (std::uint64_t k = 0; k < node.children; ++k) {
      const auto child = packed::get<Child>(page.data() + sizeof(Node) + k * sizeof(Child));
      if (!is_box(child.box) || child.region >= totals_.regions) return damaged();
      all.extend({child.box[0], child.box[1]});
      all.extend({child.box[2], child.box[3]});
      if (!meets(child.box, area)) continue;
      if (todo.level == 0) {
        leaves.push_back(child);
      } else {
        open.push_back({todo.level - 1, first + k, child.box});
      }
    }
    if (box_of(all) != todo.box) return damaged();
  }
  return leaves;
}

Result<std::vector<RegionId>> PackedIndex::meeting(const Bounds2& area) const {
  VANTAGE_TRY(const std::vector<Child> leaves, leaves_meeting(area));
  std::vector<RegionId> found;
  found.reserve(leaves.size());
  for (const Child& leaf : leaves) found.push_back(RegionId{leaf.region});
  std::ranges::sort(found);
  if (std::ranges::adjacent_find(found) == found.end()) return found;
  return corrupt("the tree has a region twice");
}

Result<std::optional<RegionId>> PackedIndex::find(std::string_view label) const {
  const std::uint64_t wanted = checksum_of(label);
  Page page;
  std::uint64_t in_page = ~std::uint64_t{0};
  const auto at = [&](std::uint64_t k) -> Result<Label> {
    if (k / kLabels != in_page) {
      in_page = k / kLabels;
      VANTAGE_CHECK(read_page(layout_.first_labels + in_page, page));
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
    if (checksum_of(region.region.label) != wanted) return corrupt("a page of labels is damaged");
  }
  return std::nullopt;
}

Result<std::vector<IndexedRegion>> PackedIndex::all() const {
  std::vector<IndexedRegion> regions;
  regions.reserve(totals_.regions);
  RegionTotals totals;
  for (std::uint32_t r = 0; r < totals_.regions; ++r) {
    VANTAGE_TRY(IndexedRegion region, entry(r));
    totals.add(bounds_of(region.region.footprint), region.file);
    regions.push_back(std::move(region));
  }
  const Summary said = totals.summary(summary_.entries_bytes, summary_.content);
  if (std::memcmp(&said, &summary_, sizeof said) != 0) {
    return corrupt("the last page does not say what the regions are together");
  }
  VANTAGE_CHECK(check_tree(regions));
  VANTAGE_CHECK(check_labels(regions));
  VANTAGE_CHECK(check_content());
  return regions;
}

/// Whether the tree has each region once, in its rectangle.
Result<void> PackedIndex::check_tree(std::span<const IndexedRegion> regions) const {
  VANTAGE_TRY(std::vector<Child> leaves, leaves_meeting(totals_.extent));
  std::ranges::sort(leaves, {}, &Child::region);
  for (std::size_t r = 0; r < regions.size(); ++r) {
    const Box own = box_of(bounds_of(regions[r].region.footprint));
    if (r < leaves.size() && leaves[r].region == r && leaves[r].box == own) continue;
    return corrupt("the tree does not have region " + std::to_string(r) + " once and in its place");
  }
  return {};
}

/// Whether the labels are those of the regions, in their order.
Result<void> PackedIndex::check_labels(std::span<const IndexedRegion> regions) const {
  std::vector<Label> labels;
  for (std::uint32_t r = 0; r < regions.size(); ++r) {
    labels.push_back({.hash = checksum_of(regions[r].region.label), .region = r, .unused = 0});
  }
  std::ranges::sort(labels, {}, [](const Label& l) { return std::pair(l.hash, l.region); });
  Page page;
  for (std::size_t k = 0; k < labels.size(); ++k) {
    if (k % kLabels == 0) VANTAGE_CHECK(read_page(layout_.first_labels + k / kLabels, page));
    const auto here = packed::get<Label>(page.data() + k % kLabels * sizeof(Label));
    if (here.hash != labels[k].hash || here.region != labels[k].region) {
      return corrupt("the labels are not those of the regions");
    }
  }
  return {};
}

/// Whether the last page says the checksum of all before it.
Result<void> PackedIndex::check_content() const {
  Checksum content;
  VANTAGE_TRY(std::uint64_t end, offset_of(0));
  if (end != 0) return corrupt("the table of entries is damaged");
  for (std::uint64_t r = 1; r <= totals_.regions; ++r) {
    VANTAGE_TRY(end, offset_of(r));
    std::array<char, sizeof(std::uint64_t)> sum;
    VANTAGE_CHECK(file_.read(end - sum.size(), sum));
    content.add(packed::get<std::uint64_t>(sum.data()));
  }
  if (end != summary_.entries_bytes) return corrupt("the table of entries is damaged");
  Page page;
  for (std::uint64_t k = layout_.first_offsets; k < layout_.last; ++k) {
    VANTAGE_CHECK(read_page(k, page));
    content.add(packed::get<std::uint64_t>(page.data() + kContent));
  }
  if (content.value() == summary_.content) return {};
  return corrupt("the last page does not have the checksum of the file");
}

tl::unexpected<Error> PackedIndex::corrupt(const std::string& reason) const {
  return fail(ErrorCode::corrupt_data, reason, SourceLocation{file_.name(), 0, 0});
}

}  // namespace vantage::bundle_folder
