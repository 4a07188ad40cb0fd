// S17 to S24: what a MapStore keeps beside the regions.
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
  const auto store = place.open(subject);
  require(store->begin(some_bundle(subject).index), "begin");
  const auto attached = store->attach("places", bytes_of("one"));
  if (!attached && attached.error().code == ErrorCode::unsupported) {
    MESSAGE("the store keeps no attachments: " << to_string(attached.error()));
    return false;
  }
  require(attached, "attach");
  return true;
}

Bytes attachment_in(const MapStore& store, std::string_view name) {
  auto bytes = store.attachment(name);
  if (!bytes) FAIL("'" << name << "' is not read: " << to_string(bytes.error()));
  return *std::move(bytes);
}

/// A bundle under way, with one attachment.
PluginPtr<MapStore> begun_with(const Subject& subject, const Place& place, const Bundle& bundle,
                               std::string_view name, const Bytes& bytes) {
  auto store = place.open(subject);
  require(store->begin(bundle.index), "begin");
  require(store->attach(name, bytes), "attach");
  return store;
}

}  // namespace

void attached_bytes(const Subject& subject) {
  if (!keeps_attachments(subject)) return;
  Random random(subject.seed());
  const Bundle bundle = some_bundle(subject);
  const std::array<std::pair<std::string, Bytes>, 5> all{
      {{"nothing", {}},
       {"zeros", Bytes(1000)},
       {"some", some_prepared(random, 999, 1).bytes},
       {"more", some_prepared(random, 70'000, 1).bytes},
       {"text", bytes_of("lines\r\nand\nmore\r")}}};
  const Place place(subject);
  const auto store = place.open(subject);
  require(store->begin(bundle.index), "begin");
  for (std::uint32_t r = 0; r < bundle.maps.size(); ++r) {
    for (std::size_t i = r; i < all.size(); i += bundle.maps.size()) {
      require(store->attach(all[i].first, all[i].second), "attach");
    }
    require(store->put(RegionId{r}, bundle.maps[r]), "put");
  }
  require(store->commit(), "commit");
  const auto reader = place.open(subject);
  for (const auto& [name, bytes] : all) {
    CAPTURE(name);
    CHECK_MESSAGE(attachment_in(*reader, name) == bytes, "the bytes differ");
    CHECK_MESSAGE(attachment_in(*store, name) == bytes,
                  "the bytes differ for the store that wrote");
  }
  check_kept(subject, bundle, *reader);
}

void attach_supported(const Subject& subject) {
  const bool keeps = keeps_attachments(subject);
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  const auto store = place.open(subject);
  const auto check_unsupported = [&] {
    if (keeps) return;
    for (const auto name : kAllowed) {
      check_fails(store->attach(name, bytes_of(name)), ErrorCode::unsupported);
    }
  };
  check_unsupported();
  require(store->begin(bundle.index), "begin");
  check_unsupported();
  for (const auto name : kAllowed) {
    if (keeps) require(store->attach(name, bytes_of(name)), "attach");
  }
  put_all(*store, bundle);
  require(store->commit(), "commit");
  check_unsupported();
  const auto reader = place.open(subject);
  for (const auto name : kAllowed) {
    if (keeps) CHECK(attachment_in(*reader, name) == bytes_of(name));
    if (!keeps) check_fails(reader->attachment(name), ErrorCode::not_found);
  }
}

void not_attached(const Subject& subject) {
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  const auto nothing_in = [&](const MapStore& store) {
    for (const std::string name : {"place", "placess", "region_", "index", "", ".", "../places",
                                   "Places", "places.dat", "index.json"}) {
      CAPTURE(name);
      check_fails(store.attachment(name), ErrorCode::not_found);
    }
  };
  const auto store = place.open(subject);
  nothing_in(*store);
  check_fails(store->attachment("places"), ErrorCode::not_found);
  require(store->begin(bundle.index), "begin");
  if (keeps_attachments(subject)) require(store->attach("places", bytes_of("one")), "attach");
  put_all(*store, bundle);
  require(store->commit(), "commit");
  nothing_in(*store);
  nothing_in(*place.open(subject));
}

void attached_twice(const Subject& subject) {
  if (!keeps_attachments(subject)) return;
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  const auto store = begun_with(subject, place, bundle, "places", bytes_of("first"));
  for (const char* second : {"second", "first", ""}) {
    check_fails(store->attach("places", bytes_of(second)), ErrorCode::already_exists);
  }
  put_all(*store, bundle);
  require(store->commit(), "commit");
  CHECK(attachment_in(*place.open(subject), "places") == bytes_of("first"));
}

void attach_without_begin(const Subject& subject) {
  if (!keeps_attachments(subject)) return;
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  const auto store = place.open(subject);
  check_fails(store->attach("places", bytes_of("one")), ErrorCode::not_found);
  write(*store, bundle);
  for (const char* text : {"one", "another that is longer", ""}) {
    CAPTURE(text);
    require(place.open(subject)->attach("places", bytes_of(text)), "attach");
    CHECK(attachment_in(*place.open(subject), "places") == bytes_of(text));
    CHECK(attachment_in(*store, "places") == bytes_of(text));
  }
  require(store->attach("more", bytes_of("by the store that wrote")), "attach");
  CHECK(attachment_in(*place.open(subject), "more") == bytes_of("by the store that wrote"));
  check_fails(store->attach("../more", bytes_of("one")), ErrorCode::invalid_input);
  check_kept(subject, bundle, *place.open(subject));
}

void attachment_names(const Subject& subject) {
  if (!keeps_attachments(subject)) return;
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  const auto store = begun_with(subject, place, bundle, "places", bytes_of("one"));
  const std::array<std::string, 11> wrong{
      "",     "Places", "places2", "two-words", "two words",         ".",
      "../a", "a/b",    "a.dat",   "\xc3\xa4",  std::string(33, 'z')};
  for (const std::string& name : wrong) {
    CAPTURE(name);
    check_fails(store->attach(name, bytes_of("one")), ErrorCode::invalid_input);
  }
  put_all(*store, bundle);
  require(store->commit(), "commit");
  CHECK(attachment_in(*store, "places") == bytes_of("one"));
}

void attachments_commit(const Subject& subject) {
  if (!keeps_attachments(subject)) return;
  const Bundle bundle = some_bundle(subject);
  const Place place(subject);
  const auto nothing_there = [&](const MapStore& store) {
    CHECK_FALSE(store.attachment("places").has_value());
  };
  {
    const auto writer = begun_with(subject, place, bundle, "places", bytes_of("one"));
    nothing_there(*writer);
    require(writer->put(RegionId{0}, bundle.maps[0]), "put");
    nothing_there(*writer);
    nothing_there(*place.open(subject));
  }
  nothing_there(*place.open(subject));
  for (const auto& left : fs::directory_iterator(place.folder())) {
    FAIL_CHECK("a store that went without a commit left " << left.path().filename());
  }
  // What was attached to the build that was given up is not in the next one.
  write(*place.open(subject), bundle);
  nothing_there(*place.open(subject));
}

void damaged_attachments(const Subject& subject) {
  if (!keeps_attachments(subject)) return;
  Random random(subject.seed());
  const Bundle bundle = some_bundle(subject);
  const Bytes bytes = some_prepared(random, 500, 1).bytes;
  const Place place(subject);
  const auto writer = begun_with(subject, place, bundle, "places", bytes);
  put_all(*writer, bundle);
  require(writer->commit(), "commit");
  const Bytes sound = attachment_in(*place.open(subject), "places");
  for (const auto& [file, good] : files_below(place.folder())) {
    CAPTURE(file.string());
    for (const Damaged& damaged : damages(random, good)) {
      CAPTURE(damaged.how);
      write_file(place.folder() / file, damaged.content);
      const auto read = place.open(subject)->attachment("places");
      if (!read)
        CHECK_MESSAGE(read.error().code == ErrorCode::corrupt_data, to_string(read.error()));
      if (read) REQUIRE_MESSAGE(*read == sound, "the attachment is read and wrong");
    }
    fs::remove(place.folder() / file);
    const auto read = place.open(subject)->attachment("places");
    if (read) REQUIRE_MESSAGE(*read == sound, "the attachment is read and wrong");
    write_file(place.folder() / file, good);
  }
  CHECK(attachment_in(*place.open(subject), "places") == sound);
}

}  // namespace vantage::conformance
