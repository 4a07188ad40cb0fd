#include <algorithm>
#include <cmath>
#include <utility>

#include "common/packed_entry.hpp"
#include "common/packed_index.hpp"
#include "common/packed_pages.hpp"

namespace vantage::bundle_folder {
namespace {

using namespace packed;  // NOLINT(google-build-using-namespace)

/// An entry: its number, the region, its file, and a checksum of all that.
std::string encode(const BundleFormat& format, IndexedRegion one, std::uint32_t number) {
  EntryWriter writer;
  writer.put(number);
  describe(writer, format, one);
  std::string bytes = std::move(writer).take();
  put(bytes, checksum_of(bytes));
  return bytes;
}

/// Pages one after another, numbered through the file.
class Pages {
 public:
  Pages(const Sink& sink, std::uint64_t first, Checksum& content)
      : sink_(sink), next_(first), content_(content) {}
  [[nodiscard]] std::uint64_t next() const noexcept { return next_; }
  [[nodiscard]] Result<void> write(std::string content) {
    content.resize(kContent, '\0');
    const std::uint64_t sum = sum_of_page(content.data(), next_++);
    content_.add(sum);
    put(content, sum);
    return sink_(content);
  }
  /// Records, as many in a page as fit.
  template <class Record>
  [[nodiscard]] Result<void> write_all(std::span<const Record> records, std::size_t in_page) {
    for (std::size_t at = 0; at < records.size(); at += in_page) {
      const auto some = records.subspan(at, std::min(in_page, records.size() - at));
      VANTAGE_CHECK(write({reinterpret_cast<const char*>(some.data()), some.size_bytes()}));
    }
    return {};
  }

 private:
  const Sink& sink_;
  std::uint64_t next_;
  Checksum& content_;
};

Child around(std::span<const Child> children) {
  Child all{.box = children.front().box, .region = 0, .unused = 0};
  for (const Child& child : children) {
    for (const std::size_t k : {0U, 1U}) {
      all.box[k] = std::min(all.box[k], child.box[k]);
      all.box[k + 2] = std::max(all.box[k + 2], child.box[k + 2]);
    }
  }
  return all;
}

/// Puts what lies together into one page: slices along x, and pages along y in each (Leutenegger,
/// Lopez and Edgington, 1997).
void tile(std::vector<Child>& children) {
  const auto middle = [](const Child& child, std::size_t axis) {
    return 0.5 * child.box[axis] + 0.5 * child.box[axis + 2];
  };
  const auto sort = [&](auto begin, auto end, std::size_t axis) {
    std::sort(begin, end, [&](const Child& a, const Child& b) {
      const double x = middle(a, axis), y = middle(b, axis);
      return x != y ? x < y : a.region < b.region;
    });
  };
  const auto pages = static_cast<double>(pages_for(children.size(), kChildren));
  const auto slice = static_cast<std::size_t>(std::ceil(std::sqrt(pages))) * kChildren;
  sort(children.begin(), children.end(), 0);
  for (std::size_t at = 0; at < children.size(); at += slice) {
    const auto begin = children.begin() + static_cast<std::ptrdiff_t>(at);
    const auto end =
        children.begin() + static_cast<std::ptrdiff_t>(std::min(at + slice, children.size()));
    sort(begin, end, 1);
  }
}

/// Writes the tree, its root last. Neighbours of a level follow each other, so they have a parent.
Result<void> write_tree(std::vector<Child> children, Pages& pages) {
  tile(children);
  for (std::uint32_t level = 0;; ++level) {
    std::vector<Child> parents;
    for (std::size_t at = 0; at < children.size(); at += kChildren) {
      const auto some = std::span(children).subspan(at, std::min(kChildren, children.size() - at));
      std::string content;
      put(content, Node{.children = static_cast<std::uint32_t>(some.size()), .level = level});
      for (const Child& child : some) put(content, child);
      parents.push_back(around(some));
      VANTAGE_CHECK(pages.write(std::move(content)));
    }
    if (parents.size() == 1) return {};
    children = std::move(parents);
  }
}

}  // namespace

void RegionTotals::add(const Bounds2& box, const RegionFile& file) {
  least_points = regions == 0 ? file.points : std::min(least_points, file.points);
  most_points = std::max(most_points, file.points);
  ++regions;
  if (file.summary().empty()) ++empty;
  if (file.points == 0) ++without_points;
  points += file.points;
  viewpoints += file.viewpoints;
  elements += file.elements;
  bytes += file.bytes;
  max_views = std::max<std::uint64_t>(max_views, file.max_views);
  extent.extend(box.min);
  extent.extend(box.max);
}

Summary RegionTotals::summary(std::uint64_t entries_bytes, std::uint64_t content) const {
  return {.title = kTitle,
          .version = kVersion,
          .regions = regions,
          .entries_bytes = entries_bytes,
          .content = content,
          .empty = empty,
          .without_points = without_points,
          .least_points = least_points,
          .most_points = most_points,
          .points = points,
          .viewpoints = viewpoints,
          .elements = elements,
          .bytes = bytes,
          .max_views = max_views,
          .extent = {extent.min.x(), extent.min.y(), extent.max.x(), extent.max.y()}};
}

Result<RegionsReference> write_packed(const BundleFormat& format, std::span<const Region> regions,
                                      std::span<const RegionFile> files, const Sink& sink) {
  RegionTotals totals;
  std::vector<std::uint64_t> offsets;
  std::vector<Child> leaves;
  std::vector<Label> labels;
  Checksum content;
  std::uint64_t end = 0;
  for (std::uint32_t r = 0; r < regions.size(); ++r) {
    const Bounds2 box = bounds_of(regions[r].footprint);
    totals.add(box, files[r]);
    offsets.push_back(end);
    leaves.push_back(
        {.box = {box.min.x(), box.min.y(), box.max.x(), box.max.y()}, .region = r, .unused = 0});
    labels.push_back({.hash = checksum_of(regions[r].label), .region = r, .unused = 0});
    const std::string bytes = encode(format, {regions[r], files[r]}, r);
    content.add(get<std::uint64_t>(bytes.data() + bytes.size() - sizeof(std::uint64_t)));
    VANTAGE_CHECK(sink(bytes));
    end += bytes.size();
  }
  offsets.push_back(end);
  const Layout layout = Layout::of(regions.size(), end);
  VANTAGE_CHECK(sink(std::string(layout.first_offsets * kPage - end, '\0')));

  Pages pages(sink, layout.first_offsets, content);
  VANTAGE_CHECK(pages.write_all<std::uint64_t>(offsets, kOffsets));
  VANTAGE_CHECK(write_tree(std::move(leaves), pages));
  std::ranges::sort(labels, {}, [](const Label& l) { return std::pair(l.hash, l.region); });
  VANTAGE_CHECK(pages.write_all<Label>(labels, kLabels));

  std::string last;
  put(last, totals.summary(end, content.value()));
  last.resize(kContent, '\0');
  const std::uint64_t checksum = sum_of_page(last.data(), layout.last);
  VANTAGE_CHECK(pages.write(std::move(last)));
  return RegionsReference{
      .count = totals.regions, .bytes = (layout.last + 1) * kPage, .checksum = checksum};
}

}  // namespace vantage::bundle_folder
