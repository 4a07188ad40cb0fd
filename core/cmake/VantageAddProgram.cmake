# vantage_add_program(<job> [COMPONENT <name>] SOURCES <file>... [LIBRARIES <target>...]): the program vantage-<job>
#
# It is installed with the component programs, unless COMPONENT says otherwise (VantageInstall.cmake).
# The sources of a program read options and print; libraries do the work. So they are compiled with
# vantage_light_options, and the headers that take longest, above all CLI11, are parsed once for all programs.
function(vantage_add_program job)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "COMPONENT" "SOURCES;LIBRARIES")
  add_executable(vantage-${job} ${ARG_SOURCES})
  target_link_libraries(vantage-${job} PRIVATE vantage::terminal vantage_warnings ${ARG_LIBRARIES})
  target_compile_options(vantage-${job} PRIVATE ${vantage_light_options})
  if(TARGET vantage_program_headers AND NOT "Open3D::Open3D" IN_LIST ARG_LIBRARIES)  # it has options of its own
    target_precompile_headers(vantage-${job} REUSE_FROM vantage_program_headers)
  endif()
  vantage_install_program(vantage-${job} ${ARG_COMPONENT})
endfunction()

if(VANTAGE_PRECOMPILE_HEADERS)
  file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/program_headers.cpp" CONTENT "// Only headers.\n")
  vantage_precompile_headers(vantage_program_headers
    SOURCE "${PROJECT_BINARY_DIR}/program_headers.cpp" LIBRARIES vantage::terminal
    HEADERS <CLI/CLI.hpp> <Eigen/Geometry> <fmt/format.h> <nlohmann/json.hpp> <tl/expected.hpp>
      <algorithm> <filesystem> <fstream> <iostream> <map> <memory> <optional> <string> <variant> <vector>)
endif()
