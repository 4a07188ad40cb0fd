#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "common/packed_index.hpp"
#include "common/packed_pages.hpp"
#include "vantage/overloaded.hpp"

namespace vantage::bundle_folder {
namespace {

using namespace packed;  // NOLINT(google-build-using-namespace)

constexpr std::uint64_t kVersion = 1;

void put_box(std::string& to, const HalfOpenBox& box) {
  for (const double x : {box.min.x(), box.min.y(), box.max.x(), box.max.y()}) put(to, x);
}

/// An entry: the region, its file, and a checksum of both and of its number.
std::string encode(const Region& region, const RegionFile& file, std::uint32_t number) {
  std::string bytes;
  put(bytes, number);
  put(bytes, static_cast<std::uint32_t>(region.label.size()));
  bytes += region.label;
  put(bytes, static_cast<std::uint32_t>(region.footprint.index()));
  std::visit(Overloaded{[&](const HalfOpenBox& box) { put_box(bytes, box); },
                        [&](const ConvexPolygon& polygon) {
                          put(bytes, static_cast<std::uint32_t>(polygon.corners.size()));
                          for (const auto& corner : polygon.corners) {
                            put(bytes, corner.x());
                            put(bytes, corner.y());
                          }
                        },
                        [&](const BoxUnion& all) {
                          put(bytes, static_cast<std::uint32_t>(all.boxes.size()));
                          for (const auto& box : all.boxes) put_box(bytes, box);
                        }},
             region.footprint);
  put(bytes, region.height.min);
  put(bytes, region.height.max);
  for (const std::uint64_t count : {file.points, file.viewpoints, file.elements,
                                    file.prepared_bytes, file.bytes, file.checksum}) {
    put(bytes, count);
  }
  for (const double x : {file.origin.x(), file.origin.y(), file.origin.z()}) put(bytes, x);
  put(bytes, file.max_views);
  Fnv1a sum;
  sum.add(bytes);
  put(bytes, sum.value());
  return bytes;
}

/// Pages one after another, numbered through the file.
class Pages {
 public:
  Pages(const Sink& sink, std::uint64_t first) : sink_(sink), next_(first) {}
  [[nodiscard]] std::uint64_t next() const noexcept { return next_; }
  [[nodiscard]] Result<void> write(std::string content) {
    content.resize(kContent, '\0');
    put(content, sum_of_page(content.data(), next_++));
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
};

Child around(std::span<const Child> children, std::uint32_t number) {
  Child all{.box = children.front().box, .number = number, .unused = 0};
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
      return x != y ? x < y : a.number < b.number;
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

/// Writes the tree, its root last. @return  the page of the root
Result<std::uint64_t> write_tree(std::vector<Child> children, Pages& pages) {
  for (std::uint32_t level = 0;; ++level) {
    tile(children);
    std::vector<Child> parents;
    for (std::size_t at = 0; at < children.size(); at += kChildren) {
      const auto some = std::span(children).subspan(at, std::min(kChildren, children.size() - at));
      std::string content;
      put(content, Node{.children = static_cast<std::uint32_t>(some.size()), .level = level});
      for (const Child& child : some) put(content, child);
      parents.push_back(around(some, static_cast<std::uint32_t>(pages.next())));
      VANTAGE_CHECK(pages.write(std::move(content)));
    }
    if (parents.size() == 1) return parents.front().number;
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

Result<PackedRegions> write_packed(std::span<const Region> regions,
                                   std::span<const RegionFile> files, const Sink& sink) {
  RegionTotals totals;
  std::vector<std::uint64_t> offsets;
  std::vector<Child> leaves;
  std::vector<Label> labels;
  std::uint64_t end = 0;
  for (std::uint32_t r = 0; r < regions.size(); ++r) {
    const Bounds2 box = bounds_of(regions[r].footprint);
    totals.add(box, files[r]);
    offsets.push_back(end);
    leaves.push_back(
        {.box = {box.min.x(), box.min.y(), box.max.x(), box.max.y()}, .number = r, .unused = 0});
    labels.push_back({.hash = hash_of_label(regions[r].label), .region = r, .unused = 0});
    const std::string bytes = encode(regions[r], files[r], r);
    VANTAGE_CHECK(sink(bytes));
    end += bytes.size();
  }
  offsets.push_back(end);
  const std::uint64_t before = pages_for(end, kPage);
  VANTAGE_CHECK(sink(std::string(before * kPage - end, '\0')));

  Pages pages(sink, before);
  VANTAGE_CHECK(pages.write_all<std::uint64_t>(offsets, kOffsets));
  VANTAGE_TRY(const std::uint64_t root, write_tree(std::move(leaves), pages));
  std::sort(labels.begin(), labels.end(), [](const Label& a, const Label& b) {
    return std::pair(a.hash, a.region) < std::pair(b.hash, b.region);
  });
  const std::uint64_t first_labels = pages.next();
  VANTAGE_CHECK(pages.write_all<Label>(labels, kLabels));

  std::string last;
  put(last, Summary{.title = kTitle,
                    .version = kVersion,
                    .regions = totals.regions,
                    .entries_bytes = end,
                    .first_offsets = before,
                    .root = root,
                    .first_labels = first_labels,
                    .pages = pages.next(),
                    .empty = totals.empty,
                    .without_points = totals.without_points,
                    .least_points = totals.least_points,
                    .most_points = totals.most_points,
                    .points = totals.points,
                    .viewpoints = totals.viewpoints,
                    .elements = totals.elements,
                    .bytes = totals.bytes,
                    .max_views = totals.max_views,
                    .extent = {totals.extent.min.x(), totals.extent.min.y(), totals.extent.max.x(),
                               totals.extent.max.y()}});
  last.resize(kContent, '\0');
  const std::uint64_t checksum = sum_of_page(last.data(), pages.next());
  VANTAGE_CHECK(pages.write(std::move(last)));
  return PackedRegions{
      .count = totals.regions, .bytes = pages.next() * kPage, .checksum = checksum};
}

}  // namespace vantage::bundle_folder
