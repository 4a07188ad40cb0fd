# vantage_add_program(<job> SOURCES <file>... [LIBRARIES <target>...]): the program vantage-<job>
#
# The sources of a program read options and print; the work is done in libraries. They are therefore
# compiled with vantage_program_options, which is -O1, and the headers that take longest, CLI11 before all, are parsed once for all programs.
function(vantage_add_program job)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "SOURCES;LIBRARIES")
  add_executable(vantage-${job} ${ARG_SOURCES})
  target_link_libraries(vantage-${job} PRIVATE vantage::terminal vantage_warnings ${ARG_LIBRARIES})
  target_compile_options(vantage-${job} PRIVATE ${vantage_program_options})
  if(TARGET vantage_program_headers AND NOT "Open3D::Open3D" IN_LIST ARG_LIBRARIES)  # it has options of its own
    target_precompile_headers(vantage-${job} REUSE_FROM vantage_program_headers)
  endif()
  vantage_install_program(vantage-${job})
endfunction()

# What GCC takes for uninitialized, or for outside an array, depends on the level, so it is no error here.
set(vantage_program_options
  "$<$<NOT:$<CONFIG:Debug>>:-O1>" -Wno-error=maybe-uninitialized -Wno-error=array-bounds)
if(VANTAGE_PRECOMPILE_HEADERS)
  file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/program_headers.cpp" CONTENT "// Only headers.\n")
  add_library(vantage_program_headers OBJECT "${PROJECT_BINARY_DIR}/program_headers.cpp")
  target_link_libraries(vantage_program_headers PRIVATE vantage::terminal vantage_warnings)
  target_precompile_headers(vantage_program_headers PRIVATE
    <CLI/CLI.hpp> <Eigen/Geometry> <fmt/format.h> <nlohmann/json.hpp> <tl/expected.hpp>
    <algorithm> <filesystem> <fstream> <iostream> <map> <memory> <optional> <string> <variant> <vector>)
  # As the programs that use them, not as a library.
  set_target_properties(vantage_program_headers PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_compile_options(vantage_program_headers PRIVATE ${vantage_program_options} -fPIE)
endif()
