# cmake -DOUT=<file> -DNAME=<name> "-DFILES=<file>|<file>..." -P embed_files.cmake: files as C++ source, byte by byte, for
# `vantage::<name>::asset` of <name>/assets.hpp. String literals are limited in length, and assembler directives hide
# what a file depends on.
string(REPLACE "|" ";" files "${FILES}")
set(arrays "")
set(cases "")
set(number 0)
foreach(file IN LISTS files)
  get_filename_component(name "${file}" NAME)
  file(READ "${file}" hex HEX)
  string(REGEX REPLACE "(................................)" "\\1\n" hex "${hex}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${hex}")
  string(APPEND arrays "constexpr char kFile${number}[] = {\n${bytes}};\n")
  string(APPEND cases "  if (name == \"${name}\") return {kFile${number}, sizeof kFile${number}};\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE "${OUT}" "#include \"${NAME}/assets.hpp\"\n\nnamespace vantage::${NAME} {\nnamespace {\n\n${arrays}\n}  // namespace\n
std::string_view asset(std::string_view name) noexcept {\n${cases}  return {};\n}\n\n}  // namespace vantage::${NAME}\n")
