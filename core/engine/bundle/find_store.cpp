#include "bundle/find_store.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vantage/kit/file_content.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

/// Reads only as far as the member "format" of the outermost object.
class FormatOf final : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::optional<std::string> format;

  bool null() override { return other(); }
  bool boolean(bool) override { return other(); }
  bool number_integer(number_integer_t) override { return other(); }
  bool number_unsigned(number_unsigned_t) override { return other(); }
  bool number_float(number_float_t, const string_t&) override { return other(); }
  bool binary(binary_t&) override { return other(); }
  bool string(string_t& text) override {
    if (!is_format_) return true;
    format = text;
    return false;
  }
  bool start_object(std::size_t) override { return open(); }
  bool start_array(std::size_t) override { return depth_ > 0 && open(); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    is_format_ = depth_ == 1 && name == "format";
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    return false;
  }

 private:
  bool other() const { return !is_format_; }  // a format that is not text names no store
  bool open() {
    ++depth_;
    return !is_format_;
  }
  bool close() {
    --depth_;
    return true;
  }

  int depth_ = 0;
  bool is_format_ = false;
};

/// Whether a store only reads, as one for the files of another program.
bool only_reads(const MapStore& store) {
  const auto may = store.may_begin();
  return !may && may.error().code == ErrorCode::unsupported;
}

tl::unexpected<Error> broken_contract(const std::string& method) {
  return fail(ErrorCode::internal,
              "the store plugin broke its contract: " + method + " gave nothing and no error");
}

/// The store that a folder names in its `index.json`, near its beginning.
std::optional<std::string> store_named_in(const fs::path& folder) {
  constexpr std::string_view kPrefix = "vantage ";
  constexpr std::size_t kMostRead = std::size_t{4} << 20U;  // what stores write, at most [bytes]
  const auto file = io::InputFile::open(folder / "index.json", "an index");
  if (!file) return std::nullopt;
  std::string text(std::min(file->size(), kMostRead), '\0');
  if (!file->read(0, text)) return std::nullopt;
  FormatOf reader;
  (void)nlohmann::json::sax_parse(text, &reader);
  if (!reader.format || !reader.format->starts_with(kPrefix)) return std::nullopt;
  return reader.format->substr(kPrefix.size());
}

/// The only required parameter of a store, if it is a path: that of its bundle.
std::optional<std::string> key_of_place(const std::vector<ParameterDoc>& docs) {
  const auto required = [](const ParameterDoc& doc) { return doc.required; };
  const auto key = std::find_if(docs.begin(), docs.end(), required);
  if (std::count_if(docs.begin(), docs.end(), required) != 1 || key->array ||
      key->kind != ValueKind::path) {
    return std::nullopt;
  }
  return key->key;
}

/// A store's parameters for a bundle at `place`; none if the store needs more than a path.
std::optional<Table> params_for(const fs::path& place, const std::vector<ParameterDoc>& docs) {
  auto key = key_of_place(docs);
  if (!key) return std::nullopt;
  Table params;
  params.entries.push_back({*std::move(key), {place.string(), {}}, {}});
  return params;
}

/// Opens a store over a place. Returns no store if the plugin cannot say where its bundle lies.
Result<PluginPtr<MapStore>> store_over(const fs::path& place, PluginChoice choice,
                                       const PluginLoader& plugins) {
  VANTAGE_TRY(const auto docs, plugins.parameters(PluginKind::store, choice));
  auto params = params_for(place, docs);
  if (!params) {
    return fail(ErrorCode::unsupported, "the store '" + choice.plugin +
                                            "' needs more parameters than a path: name the bundle "
                                            "in the [store] of a configuration");
  }
  choice.params = *std::move(params);
  return plugins.load<MapStore>(choice);
}

/// An installed store that was asked for a bundle, and the reason why it has none. Of stores that
/// give the same reason, the first speaks for all.
struct Refusal {
  std::string store;
  Error error;

  [[nodiscard]] bool says(const Error& other) const {
    return error.code == other.code && error.message == other.message;
  }
};

tl::unexpected<Error> no_store_opens(const fs::path& place, std::vector<Refusal> refusals) {
  const SourceLocation where{place.string(), 0, 0};
  if (refusals.empty()) {
    return fail(ErrorCode::not_found, "no store plugin was found that could open it", where);
  }
  // A store that finds something damaged knows whose bundle it is.
  const auto damaged = [](const Refusal& refusal) {
    return refusal.error.code != ErrorCode::not_found;
  };
  if (refusals.size() > 1 && std::ranges::count_if(refusals, damaged) == 1) {
    return fail(std::move(std::ranges::find_if(refusals, damaged)->error));
  }
  if (refusals.size() == 1) return fail(std::move(refusals.front().error));
  std::string message = "no store finds a bundle of region maps here";
  bool missing = true;
  for (const Refusal& refusal : refusals) {
    message += "; " + refusal.store + ": " + refusal.error.message;
    missing = missing && refusal.error.code == ErrorCode::not_found;
  }
  return fail(missing ? ErrorCode::not_found : ErrorCode::corrupt_data, std::move(message), where);
}

}  // namespace

Result<OpenBundle> with_directory(PluginPtr<const MapReader> reader) {
  VANTAGE_TRY(auto directory, reader->directory());
  if (!directory) return broken_contract("directory");
  std::shared_ptr<const RegionDirectory> owned(in_library_of(reader, std::move(directory)));
  return OpenBundle{std::move(reader), std::move(owned)};
}

Result<OpenBundle> open_in(const PluginPtr<MapStore>& store) {
  auto reader = store->open();
  if (reader) {
    if (*reader == nullptr) return broken_contract("open");
    return with_directory(in_library_of(store, *std::move(reader)));
  }
  Error error = std::move(reader).error();
  if (error.code == ErrorCode::not_found && !only_reads(*store)) {
    error.message += "; `vantage build` makes it";
  }
  return fail(std::move(error));
}

std::optional<fs::path> place_in(const Table& params, const std::vector<ParameterDoc>& docs) {
  const auto key = key_of_place(docs);
  const Value* const value = key ? params.find(*key) : nullptr;
  const auto* const text = value != nullptr ? std::get_if<std::string>(&value->data) : nullptr;
  if (text == nullptr) return std::nullopt;
  fs::path place = resolve_path(*text, value->where);
  if (!place.has_filename()) place = place.parent_path();
  return place;
}

Result<OpenBundle> find_bundle(const fs::path& place, const PluginLoader& plugins) {
  if (const auto named = store_named_in(place)) {
    const PluginChoice choice{.plugin = *named, .library = {}, .params = {}, .where = {}};
    auto found = store_over(place, choice, plugins).and_then(open_in);
    if (found || found.error().where) return found;
    return fail(std::move(found).error().during("opening the bundle " + place.string()));
  }
  std::vector<Refusal> refusals;
  for (const PluginFile& file : plugins.list()) {
    if (file.kind != PluginKind::store) continue;
    const PluginChoice choice{.plugin = file.name, .library = file.path, .params = {}, .where = {}};
    auto store = store_over(place, choice, plugins);
    if (!store) continue;  // a plugin that cannot be asked does not hide the others
    auto opened = open_in(*store);
    if (opened) return opened;
    // Most bundles were built here: no other program's files are missed where nothing is.
    if (only_reads(**store) && opened.error().code == ErrorCode::not_found) continue;
    const auto says_it = [&](const Refusal& refusal) { return refusal.says(opened.error()); };
    if (std::ranges::any_of(refusals, says_it)) continue;
    refusals.push_back({file.name, std::move(opened).error()});
  }
  return no_store_opens(place, std::move(refusals));
}

}  // namespace vantage
