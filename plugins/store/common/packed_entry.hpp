#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/index_format.hpp"
#include "common/packed_pages.hpp"

/// Archives (index_format.hpp) of the bytes of an entry.
namespace vantage::bundle_folder::packed {

/// Appends what it visits.
class EntryWriter {
 public:
  [[nodiscard]] std::string take() && { return std::move(bytes_); }

  template <class T>
  void put(const T& value) {
    packed::put(bytes_, value);
  }
  template <class Visit>
  void member(const char* /*key*/, const Visit& visit) {
    visit();
  }
  template <class Visit>
  bool member_if(const char* /*key*/, bool is_there, const Visit& visit) {
    put(std::uint32_t{is_there});
    if (is_there) visit();
    return is_there;
  }
  template <class Visit>
  void object(const Visit& visit) {
    visit();
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
  void count(std::uint64_t value, std::uint64_t /*max*/) { put(value); }
  void checksum(std::uint64_t value) { put(value); }
  template <class Reason>
  void check(bool /*ok*/, const char* /*key*/, const Reason& /*reason*/) noexcept {}

 private:
  std::string bytes_;
};

/// Takes what it visits from the front of bytes. After the first thing that is not there or not
/// sound, all of it fails.
class EntryReader {
 public:
  explicit EntryReader(std::string_view bytes) noexcept : bytes_(bytes) {}

  [[nodiscard]] bool ok_to_the_end() const noexcept { return ok_ && bytes_.empty(); }

  template <class T>
  [[nodiscard]] T get() noexcept {
    const std::string_view taken = take(sizeof(T));
    return taken.empty() ? T{} : packed::get<T>(taken.data());
  }
  template <class Visit>
  void member(const char* /*key*/, const Visit& visit) {
    if (ok_) visit();
  }
  template <class Visit>
  bool member_if(const char* /*key*/, bool /*is_there*/, const Visit& visit) {
    const auto is_there = get<std::uint32_t>();
    if (is_there > 1) ok_ = false;
    if (!ok_) return true;  // whatever comes is not the first that is wrong
    if (is_there == 1) visit();
    return is_there == 1;
  }
  template <class Visit>
  void object(const Visit& visit) {
    visit();
  }
  template <class Element, class Visit>
  void list(std::vector<Element>& elements, const Visit& visit) {
    const auto n = get<std::uint64_t>();
    if (n > bytes_.size() / sizeof(Element)) ok_ = false;  // a corner, or two of a box
    for (std::uint64_t i = 0; ok_ && i < n; ++i) visit(elements.emplace_back());
  }
  template <class Vector>
  void numbers(Vector& v) noexcept {
    for (Eigen::Index i = 0; i < v.size(); ++i) v[i] = get<double>();
  }
  void text(std::string& text) { text = take(get<std::uint64_t>()); }
  void count(std::uint64_t& value, std::uint64_t max) noexcept {
    value = get<std::uint64_t>();
    if (value > max) ok_ = false;
  }
  void checksum(std::uint64_t& value) noexcept { value = get<std::uint64_t>(); }
  template <class Reason>
  void check(bool ok, const char* /*key*/, const Reason& /*reason*/) noexcept {
    ok_ = ok_ && ok;
  }

 private:
  [[nodiscard]] std::string_view take(std::uint64_t size) noexcept {
    if (size > bytes_.size()) ok_ = false;
    if (!ok_) return {};
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }

  std::string_view bytes_;
  bool ok_ = true;
};

template <class Archive>
void describe_entry(Archive& archive, const BundleFormat& format, IndexedRegion& one) {
  archive.member("label", [&] { archive.text(one.region.label); });
  describe_area_and_file(archive, format, one);
}

}  // namespace vantage::bundle_folder::packed
