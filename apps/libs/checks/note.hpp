#pragma once

#include <cstddef>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "vantage/engine/bundle.hpp"
#include "vantage/result.hpp"

namespace vantage::checks {

/// Something about an input that is probably not what its user meant.
struct Note {
  std::string what;    ///< what was seen, with numbers: "scans reach 84,211 m"
  std::string advice;  ///< what to do about it: "give points in metres"

  friend bool operator==(const Note&, const Note&) = default;
};

/// One line a note: "note: WHAT: ADVICE".
void print(std::ostream& out, std::span<const Note> notes);

[[nodiscard]] nlohmann::ordered_json to_json(std::span<const Note> notes);

/// The name under which a bundle keeps what was noticed when it was built.
inline constexpr const char* kNotesAttachment = "notes";
[[nodiscard]] std::vector<std::byte> encode(std::span<const Note> notes);
/// Errors: `corrupt_data` for bytes that `encode` does not make.
[[nodiscard]] Result<std::vector<Note>> decode(std::span<const std::byte> bytes);
/// What the build of a bundle noticed. Errors: those above and those of MapReader::attachment.
[[nodiscard]] Result<std::vector<Note>> notes_in(const Bundle& bundle);

}  // namespace vantage::checks
