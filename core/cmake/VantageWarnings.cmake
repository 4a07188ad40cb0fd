# The one place where strictness is set. Linked PRIVATE by every target of the project.
add_library(vantage_warnings INTERFACE)
target_compile_options(vantage_warnings INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wshadow)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # GCC 12 warns falsely about `"literal" + std::string` (GCC bug 105651).
  target_compile_options(vantage_warnings INTERFACE -Wno-restrict)
endif()
if(VANTAGE_WARNINGS_AS_ERRORS)
  target_compile_options(vantage_warnings INTERFACE -Werror)
endif()
