#include "plugins/elf.hpp"

#include <cxxabi.h>
#include <link.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <string_view>
#include <type_traits>
#include <vector>

namespace vantage::elf {
namespace {

static_assert(std::is_trivially_copyable_v<ManifestHead>);
static_assert(offsetof(PluginManifest, abi) == offsetof(ManifestHead, abi));

constexpr std::uint64_t kMaxTable = 1U << 26U;  // [bytes]; symbol tables of plugins are kilobytes

/// The header of the running program: a library must be for the same processor.
ElfW(Ehdr) own_header() {
  ElfW(Ehdr) header{};
  std::ifstream("/proc/self/exe", std::ios::binary)
      .read(reinterpret_cast<char*>(&header), sizeof header);
  return header;
}

/// Reads parts of a file, and never beyond its end.
class File {
 public:
  explicit File(const std::filesystem::path& path) : in_(path, std::ios::binary) {}

  template <class T>
  [[nodiscard]] std::optional<T> read(std::uint64_t offset) {
    T value{};
    return bytes(offset, &value, sizeof value) ? std::optional(value) : std::nullopt;
  }
  template <class T>
  [[nodiscard]] std::optional<std::vector<T>> array(std::uint64_t offset, std::uint64_t count) {
    if (count > kMaxTable / sizeof(T)) return std::nullopt;
    std::vector<T> values(count);
    if (!bytes(offset, values.data(), count * sizeof(T))) return std::nullopt;
    return values;
  }

 private:
  bool bytes(std::uint64_t offset, void* to, std::uint64_t count) {
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(offset));
    in_.read(static_cast<char*>(to), static_cast<std::streamsize>(count));
    return static_cast<bool>(in_);
  }

  std::ifstream in_;
};

/// Where in the file the linker would find the address `address`.
std::optional<std::uint64_t> file_offset(const std::vector<ElfW(Phdr)>& segments,
                                         std::uint64_t address) {
  for (const auto& segment : segments) {
    if (segment.p_type == PT_LOAD && address >= segment.p_vaddr &&
        address - segment.p_vaddr < segment.p_filesz) {
      return segment.p_offset + (address - segment.p_vaddr);
    }
  }
  return std::nullopt;
}

}  // namespace

std::string defect(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return "cannot be read";
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  ElfW(Ehdr) header{};
  const std::string_view magic(ELFMAG, SELFMAG);
  in.read(reinterpret_cast<char*>(&header), sizeof header);
  if (error || std::string_view(reinterpret_cast<const char*>(header.e_ident), SELFMAG) != magic) {
    return "is not a shared library (it does not begin as an ELF file)";
  }
  const ElfW(Ehdr) own = own_header();
  if (in &&
      (header.e_ident[EI_CLASS] != own.e_ident[EI_CLASS] ||
       header.e_ident[EI_DATA] != own.e_ident[EI_DATA] || header.e_machine != own.e_machine)) {
    return "is built for another processor";
  }
  if (in && header.e_type != ET_DYN) return "is not a shared library (its ELF type is another)";
  std::string cut =
      "is cut short: its ELF headers promise more than its " + std::to_string(size) + " bytes";
  if (!in || header.e_phentsize != sizeof(ElfW(Phdr))) return cut;
  std::vector<ElfW(Phdr)> segments(header.e_phnum);
  in.seekg(static_cast<std::streamoff>(header.e_phoff));
  in.read(reinterpret_cast<char*>(segments.data()),
          static_cast<std::streamsize>(segments.size() * sizeof(ElfW(Phdr))));
  if (!in) return cut;
  for (const auto& segment : segments) {
    if (segment.p_filesz > size || segment.p_offset > size - segment.p_filesz) return cut;
  }
  const std::uint64_t sections = std::uint64_t{header.e_shnum} * header.e_shentsize;
  if (sections > size || header.e_shoff > size - sections) return cut;
  return "";
}

Inspection inspect(const std::filesystem::path& path) {
  Inspection found;
  File file(path);
  const auto header = file.read<ElfW(Ehdr)>(0);
  if (!header || header->e_shentsize != sizeof(ElfW(Shdr))) return found;
  const auto segments = file.array<ElfW(Phdr)>(header->e_phoff, header->e_phnum);
  const auto sections = file.array<ElfW(Shdr)>(header->e_shoff, header->e_shnum);
  if (!segments || !sections) return found;
  const auto dynsym = std::find_if(sections->begin(), sections->end(),
                                   [](const auto& s) { return s.sh_type == SHT_DYNSYM; });
  if (dynsym == sections->end() || dynsym->sh_link >= sections->size()) return found;
  const ElfW(Shdr)& dynstr = (*sections)[dynsym->sh_link];
  const auto symbols =
      file.array<ElfW(Sym)>(dynsym->sh_offset, dynsym->sh_size / sizeof(ElfW(Sym)));
  const auto names = file.array<char>(dynstr.sh_offset, dynstr.sh_size);
  if (!symbols || !names) return found;
  found.has_symbols = true;
  static constexpr char kName[] = "vantage_plugin";
  static constexpr std::string_view kSymbol(kName, sizeof(kName));  // with its terminating zero
  for (const auto& symbol : *symbols) {
    if (symbol.st_shndx == SHN_UNDEF || symbol.st_name > names->size() ||
        names->size() - symbol.st_name < kSymbol.size() ||
        std::string_view(names->data() + symbol.st_name, kSymbol.size()) != kSymbol) {
      continue;
    }
    found.has_manifest = true;
    if (const auto offset = file_offset(*segments, symbol.st_value)) {
      found.head = file.read<ManifestHead>(*offset);
    }
  }
  return found;
}

std::string demangled(const std::string& symbol) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> name(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &status), &std::free);
  return status == 0 ? name.get() : symbol;
}

}  // namespace vantage::elf
