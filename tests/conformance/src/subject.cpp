#include "vantage/conformance.hpp"
#include "vantage/engine/config.hpp"

namespace vantage::conformance {
namespace {

struct ParamsFile {
  Table params, claims;
  static constexpr auto schema() {
    return std::tuple{optional("params", &ParamsFile::params, "", "parameters of the plugin"),
                      optional("claims", &ParamsFile::claims, "", "what the plugin promises")};
  }
};

/// The alternatives of `Claims` are in the order of the kinds.
Result<Claims> claims_of(PluginKind kind, const Table& table) {
  static_assert(std::variant_size_v<Claims> == kPluginKinds);
  return with_kind(kind, [&]<class Interface>(const Kind<Interface>&) -> Result<Claims> {
    constexpr auto kAt = static_cast<std::size_t>(kind_of<Interface>());
    using OfKind = std::variant_alternative_t<kAt, Claims>;
    VANTAGE_TRY(OfKind claims, parse<OfKind>(table));
    return Claims(std::move(claims));
  });
}

void replace_folder(Value& value, const std::string& folder) {
  static constexpr std::string_view kPlace = "{folder}";
  if (auto* text = std::get_if<std::string>(&value.data)) {
    if (const auto at = text->find(kPlace); at != std::string::npos) {
      text->replace(at, kPlace.size(), folder);
    }
  } else if (auto* array = std::get_if<Array>(&value.data)) {
    for (Value& element : *array) replace_folder(element, folder);
  } else if (auto* table = std::get_if<Table>(&value.data)) {
    for (Entry& entry : table->entries) replace_folder(entry.value, folder);
  }
}

}  // namespace

Result<Subject> Subject::from(const std::filesystem::path& library,
                              const std::filesystem::path& params_file, std::uint32_t seed) {
  Subject subject;
  VANTAGE_TRY(subject.info_, PluginLoader({}).inspect(library));
  VANTAGE_TRY(const Table root, load_toml(params_file));
  VANTAGE_TRY(ParamsFile file, parse<ParamsFile>(root));
  for (Table* table : {&file.params, &file.claims}) {
    if (table->where.file.empty()) table->where = root.where;
  }
  auto claims = claims_of(subject.info_.kind, file.claims);
  if (!claims) {
    return fail(std::move(claims).error().during(std::string("reading [claims] of a ") +
                                                 to_string(subject.info_.kind) + " plugin"));
  }
  subject.claims_ = *std::move(claims);
  subject.params_ = std::move(file.params);
  subject.seed_ = seed;
  if (auto effective = subject.effective_params(subject.params_); !effective) {
    return fail(std::move(effective).error().during("reading [params] of plugin '" +
                                                    subject.info_.name + "'"));
  }
  return subject;
}

Table Subject::params_in(const std::filesystem::path& folder) const {
  Value value{params_, {}};
  replace_folder(value, folder.string());
  return std::get<Table>(std::move(value.data));
}

}  // namespace vantage::conformance
