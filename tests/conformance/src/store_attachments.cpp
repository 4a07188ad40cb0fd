// S17 to S24: what a bundle keeps beside the regions.
#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "clauses.hpp"
#include "store_bundles.hpp"

namespace vantage::conformance {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;

Bytes bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// Names of every form that is allowed, up to the longest.
constexpr std::array<std::string_view, 5> kAllowed{"a", "_", "places", "of_two_words",
                                                   "thirty_two_letters_are_allowed__"};

/// Whether the store keeps attachments.
bool keeps_attachments(const Subject& subject) {
  const Place place(subject);
  const auto attached =
      place.begin(subject, some_bundle(subject))->attach("places", bytes_of("one"));
  if (!attached && attached.error().code == ErrorCode::unsupported) return false;
  require(attached, "attach");
  return true;
}

/// For the clauses about a store that does.
void needs_attachments(const Subject& subject) {
  if (!keeps_attachments(subject)) does_not_apply("the store keeps no attachments");
}

Bytes attachment_in(const MapReader& reader, std::string_view name) {
  auto bytes = reader.attachment(name);
  if (!bytes) FAIL("'" << name << "' is not read: " << to_string(bytes.error()));
  return *std::move(bytes);
}

/// A bundle under way, with one attachment.
Writer begun_with(const Subject& subject, const Place& place, const Bundle& bundle,
                  std::string_view name, const Bytes& bytes) {
  Writer writer = place.begin(subject, bundle);
  require(writer->attach(name, bytes), "attach");
  return writer;
}

}  // namespace

void attached_bytes(const Subject& subject) {
  needs_attachments(subject);
  Random random(subject.seed());
  const Bundle bundle = some_bundle(subject);
  const std::array<std::pair<std::string, Bytes>, 5> all{
      {{"nothing", {}},
       {"zeros", Bytes(1000)},
       {"some", some_prepared(random, 999, 1).bytes},
       {"more", some_prepared(random, 70'000, 1).bytes},
       {"text", bytes_of("lines\r\nand\nmore\r")}}};
  const Place place(subject);
  Writer writer = place.begin(subject, bundle);
  for (std::uint32_t r = 0; r < bundle.maps.size(); ++r) {
    for (std::size_t i = r; i < all.size(); i += bundle.maps.size()) {
      require(writer->attach(all[i].first, all[i].second), "attach");
    }
    require(writer->put(RegionId{r}, bundle.maps[r]), "put");
  }
  commit(std::move(writer));
  const Reader reader = place.open(subject);
  for (const auto& [name, bytes] : all) {
    CAPTURE(name);
    CHECK_MESSAGE(attachment_in(*reader, name) == bytes, "the bytes differ");
  }
  check_kept(subject, bundle, *reader);
}

void attach_supported(const Subject& subject) {
  const bool keeps = keeps_attachments(subject);
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  Writer writer = place.begin(subject, bundle);
  for (const auto name : kAllowed) {
    if (keeps) require(writer->attach(name, bytes_of(name)), "attach");
    if (!keeps) check_fails(writer->attach(name, bytes_of(name)), ErrorCode::unsupported);
  }
  finish(std::move(writer), bundle);
  const Reader reader = place.open(subject);
  for (const auto name : kAllowed) {
    if (keeps) CHECK(attachment_in(*reader, name) == bytes_of(name));
    if (keeps) continue;
    check_fails(reader->attachment(name), ErrorCode::not_found);
    check_fails(reader->attach(name, bytes_of(name)), ErrorCode::unsupported);
  }
}

void not_attached(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  Writer writer = place.begin(subject, bundle);
  if (keeps_attachments(subject)) require(writer->attach("places", bytes_of("one")), "attach");
  finish(std::move(writer), bundle);
  const Reader reader = place.open(subject);
  for (const std::string name : {"place", "placess", "region_", "index", "", ".", "../places",
                                 "Places", "places.dat", "index.json"}) {
    CAPTURE(name);
    check_fails(reader->attachment(name), ErrorCode::not_found);
  }
}

void attached_twice(const Subject& subject) {
  needs_attachments(subject);
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  Writer writer = begun_with(subject, place, bundle, "places", bytes_of("first"));
  for (const char* second : {"second", "first", ""}) {
    check_fails(writer->attach("places", bytes_of(second)), ErrorCode::already_exists);
  }
  finish(std::move(writer), bundle);
  CHECK(attachment_in(*place.open(subject), "places") == bytes_of("first"));
}

void attached_later(const Subject& subject) {
  needs_attachments(subject);
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  finish(place.begin(subject, bundle), bundle);
  const Reader before = place.open(subject);
  for (const char* text : {"one", "another that is longer", ""}) {
    CAPTURE(text);
    require(place.open(subject)->attach("places", bytes_of(text)), "attach");
    CHECK(attachment_in(*place.open(subject), "places") == bytes_of(text));
    CHECK(attachment_in(*before, "places") == bytes_of(text));
  }
  check_fails(before->attach("../more", bytes_of("one")), ErrorCode::invalid_input);
  check_kept(subject, bundle, *before);
  check_kept(subject, bundle, *place.open(subject));
}

void attachment_names(const Subject& subject) {
  needs_attachments(subject);
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  Writer writer = begun_with(subject, place, bundle, "places", bytes_of("one"));
  const std::array<std::string, 11> wrong{
      "",     "Places", "places2", "two-words", "two words",         ".",
      "../a", "a/b",    "a.dat",   "\xc3\xa4",  std::string(33, 'z')};
  for (const std::string& name : wrong) {
    CAPTURE(name);
    check_fails(writer->attach(name, bytes_of("one")), ErrorCode::invalid_input);
  }
  finish(std::move(writer), bundle);
  CHECK(attachment_in(*place.open(subject), "places") == bytes_of("one"));
}

void attachments_commit(const Subject& subject) {
  needs_attachments(subject);
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  {
    const Writer writer = begun_with(subject, place, bundle, "places", bytes_of("one"));
    require(writer->put(RegionId{0}, bundle.maps[0]), "put");
  }
  for (const auto& left : fs::directory_iterator(place.folder())) {
    FAIL_CHECK("a writer that went without a commit left " << left.path().filename());
  }
  // What was attached to the bundle that was given up is not in the next one.
  finish(place.begin(subject, bundle), bundle);
  CHECK_FALSE(place.open(subject)->attachment("places").has_value());
}

void damaged_attachments(const Subject& subject) {
  needs_attachments(subject);
  Random random(subject.seed());
  const Bundle bundle = some_bundle(subject);
  const Bytes bytes = some_prepared(random, 500, 1).bytes;
  const Place place(subject);
  finish(begun_with(subject, place, bundle, "places", bytes), bundle);
  const Bytes sound = attachment_in(*place.open(subject), "places");
  const auto store = place.store(subject);
  const auto read = [&]() -> Result<Bytes> {
    VANTAGE_TRY(const auto reader, store->open());
    return reader->attachment("places");
  };
  for (const auto& [file, good] : files_below(place.folder())) {
    CAPTURE(file.string());
    for (const Damaged& damaged : damages(random, good)) {
      CAPTURE(damaged.how);
      write_file(place.folder() / file, damaged.content);
      const auto got = read();
      if (!got) CHECK_MESSAGE(got.error().code == ErrorCode::corrupt_data, to_string(got.error()));
      if (got) REQUIRE_MESSAGE(*got == sound, "the attachment is read and wrong");
    }
    fs::remove(place.folder() / file);
    const auto got = read();
    if (got) REQUIRE_MESSAGE(*got == sound, "the attachment is read and wrong");
    write_file(place.folder() / file, good);
  }
  CHECK(attachment_in(*place.open(subject), "places") == sound);
}

}  // namespace vantage::conformance
