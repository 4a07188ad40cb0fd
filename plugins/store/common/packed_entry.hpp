#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/bundle_format.hpp"
#include "common/packed_pages.hpp"
#include "vantage/partition.hpp"

/// The bytes of an entry, said once for writing and reading.
///
/// An Archive goes through the parts of an entry in their order. As a writer it takes the values,
/// as a reader it puts them in; after its first error it does nothing more. It has
///     bool is_there(bool);                      // a writer says it, a reader finds out
///     void list(elements, visit);
///     void text(std::string&), numbers(Eigen vector&), word(std::uint64_t&);
///     void count(name, std::uint64_t&, max);
///     void check(bool, reason);  // of a reader: refuses the entry for what reason() says
namespace vantage::bundle_folder::packed {

template <class Archive>
void describe(Archive& archive, HalfOpenBox& box) {
  archive.numbers(box.min);
  archive.numbers(box.max);
}

/// Returns whether the footprint has that shape.
template <class Shape, class Archive, class Visit>
bool describe_if(Archive& archive, Footprint& footprint, const Visit& visit) {
  if (!archive.is_there(std::holds_alternative<Shape>(footprint))) return false;
  if (!std::holds_alternative<Shape>(footprint)) footprint.emplace<Shape>();
  visit(std::get<Shape>(footprint));
  return true;
}

template <class Archive>
void describe(Archive& archive, Footprint& footprint) {
  const auto box = [&](HalfOpenBox& one) { describe(archive, one); };
  const bool known =
      describe_if<HalfOpenBox>(archive, footprint, box) ||
      describe_if<BoxUnion>(archive, footprint,
                            [&](BoxUnion& shape) { archive.list(shape.boxes, box); }) ||
      describe_if<ConvexPolygon>(archive, footprint, [&](ConvexPolygon& polygon) {
        archive.list(polygon.corners, [&](Eigen::Vector2d& corner) { archive.numbers(corner); });
      });
  archive.check(known, [] { return "a footprint must be a box, boxes or a polygon"; });
}

template <class Archive>
void describe(Archive& archive, const BundleFormat& format, RegionFile& file) {
  archive.count("points", file.points, kMaxPoints);
  archive.count("viewpoints", file.viewpoints, kMaxPoints);
  archive.word(file.elements);
  archive.count("prepared bytes", file.prepared_bytes, kMaxPreparedBytes);
  archive.check(file.elements == 0 || file.prepared_bytes > 0,
                [] { return "elements must be 0 without prepared bytes"; });
  if (archive.is_there(file.max_views > 0)) {
    std::uint64_t most = file.max_views;
    archive.count("views", most, std::numeric_limits<std::uint32_t>::max());
    file.max_views = static_cast<std::uint32_t>(most);
    archive.check(most > 0 && file.points > 0,
                  [] { return "the most views must be above 0, and left out without points"; });
  }
  archive.word(file.bytes);
  archive.numbers(file.origin);
  archive.check(file.origin.allFinite(), [] { return "the origin must be finite"; });
  archive.word(file.checksum);
  const std::uint64_t bytes = format.file_size != nullptr ? format.file_size(file) : file.bytes;
  archive.check(file.bytes == bytes, [&] {
    return "the file must have " + std::to_string(bytes) + " bytes for what it holds, not " +
           std::to_string(file.bytes);
  });
}

template <class Archive>
void describe(Archive& archive, const BundleFormat& format, IndexedRegion& one) {
  archive.text(one.region.label);
  describe(archive, one.region.footprint);
  Eigen::Vector2d height(one.region.height.min, one.region.height.max);
  archive.numbers(height);
  one.region.height = {height[0], height[1]};
  describe(archive, format, one.file);
}

/// Appends what it visits.
class EntryWriter {
 public:
  [[nodiscard]] std::string take() && { return std::move(bytes_); }

  template <class T>
  void put(const T& value) {
    packed::put(bytes_, value);
  }
  bool is_there(bool it) {
    put(std::uint32_t{it});
    return it;
  }
  template <class Element, class Visit>
  void list(std::vector<Element>& elements, const Visit& visit) {
    put(std::uint64_t{elements.size()});
    for (Element& element : elements) visit(element);
  }
  template <class Vector>
  void numbers(const Vector& v) {
    for (const double x : v) put(x);
  }
  void text(const std::string& text) {
    put(std::uint64_t{text.size()});
    bytes_ += text;
  }
  void word(std::uint64_t value) { put(value); }
  void count(const char* /*name*/, std::uint64_t value, std::uint64_t /*max*/) { put(value); }
  template <class Reason>
  void check(bool /*ok*/, const Reason& /*reason*/) noexcept {}

 private:
  std::string bytes_;
};

/// Takes what it visits from the front of bytes.
class EntryReader {
 public:
  explicit EntryReader(std::string_view bytes) noexcept : bytes_(bytes) {}

  /// Why the bytes are no entry; empty if they are one, to their end.
  [[nodiscard]] std::string defect() && {
    check(bytes_.empty(), [] { return "it is longer than what it says"; });
    return std::move(defect_);
  }

  template <class T>
  [[nodiscard]] T get() {
    const std::string_view taken = take(sizeof(T));
    return taken.empty() ? T{} : packed::get<T>(taken.data());
  }
  [[nodiscard]] bool is_there(bool /*it*/) {
    const auto word = get<std::uint32_t>();
    check(word <= 1, [] { return "a part must be there or not, 0 or 1"; });
    return defect_.empty() && word == 1;
  }
  template <class Element, class Visit>
  void list(std::vector<Element>& elements, const Visit& visit) {
    const auto n = get<std::uint64_t>();
    // A corner, or two of a box.
    check(n <= bytes_.size() / sizeof(Element), [] { return "it is shorter than what it says"; });
    for (std::uint64_t i = 0; defect_.empty() && i < n; ++i) visit(elements.emplace_back());
  }
  template <class Vector>
  void numbers(Vector& v) {
    for (Eigen::Index i = 0; i < v.size(); ++i) v[i] = get<double>();
  }
  void text(std::string& text) { text = take(get<std::uint64_t>()); }
  void word(std::uint64_t& value) { value = get<std::uint64_t>(); }
  void count(const char* name, std::uint64_t& value, std::uint64_t max) {
    value = get<std::uint64_t>();
    check(value <= max, [&] {
      return std::to_string(value) + " " + name + ", at most " + std::to_string(max) + " can be";
    });
  }
  template <class Reason>
  void check(bool ok, const Reason& reason) {
    if (!ok && defect_.empty()) defect_ = reason();
  }

 private:
  [[nodiscard]] std::string_view take(std::uint64_t size) {
    check(size <= bytes_.size(), [] { return "it is shorter than what it says"; });
    if (!defect_.empty()) return {};
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }

  std::string_view bytes_;
  std::string defect_;
};

}  // namespace vantage::bundle_folder::packed
