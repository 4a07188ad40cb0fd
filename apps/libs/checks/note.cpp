#include "checks/note.hpp"

#include <nlohmann/json.hpp>
#include <ostream>

#include "vantage/kit/json_text.hpp"

namespace vantage::checks {

void print(std::ostream& out, std::span<const Note> notes) {
  for (const Note& note : notes) out << "note: " << note.what << ": " << note.advice << '\n';
}

nlohmann::ordered_json to_json(std::span<const Note> notes) {
  auto list = nlohmann::ordered_json::array();
  for (const Note& note : notes) list.push_back({{"what", note.what}, {"advice", note.advice}});
  return list;
}

std::vector<std::byte> encode(std::span<const Note> notes) {
  const std::string text = json_line(to_json(notes));
  const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
  return {bytes, bytes + text.size()};
}

Result<std::vector<Note>> decode(std::span<const std::byte> bytes) {
  const auto corrupt = [] {
    return fail(ErrorCode::corrupt_data, "the bundle's notes are not what a build writes");
  };
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto read = parse_json<nlohmann::json>(text, "", "");
  if (!read || !read->is_array()) return corrupt();
  std::vector<Note> notes;
  for (const auto& item : *read) {
    if (!item.is_object() || !item.contains("what") || !item.contains("advice") ||
        !item["what"].is_string() || !item["advice"].is_string()) {
      return corrupt();
    }
    notes.push_back({item["what"], item["advice"]});
  }
  return notes;
}

Result<std::vector<Note>> notes_in(const Bundle& bundle) {
  VANTAGE_TRY(const auto bytes, bundle.attachment(kNotesAttachment));
  return bytes ? decode(*bytes) : std::vector<Note>();
}

}  // namespace vantage::checks
