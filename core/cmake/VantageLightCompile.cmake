# How sources are compiled that spend their time elsewhere: those of programs, which only call libraries, and those
# of tests. What GCC takes for uninitialized, or for outside an array, depends on the level, so it is no error here.
set(vantage_light_options
  "$<$<NOT:$<CONFIG:Debug>>:-O1>" "$<$<CXX_COMPILER_ID:GNU>:-Wno-error=maybe-uninitialized;-Wno-error=array-bounds>")

# vantage_precompile_headers(<target> SOURCE <file> LIBRARIES <target>... HEADERS <header>...)
# An object library whose precompiled headers executables with vantage_light_options may REUSE_FROM. Headers of the
# project do not belong into it: a change of one must not compile everything again.
function(vantage_precompile_headers target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "SOURCE" "LIBRARIES;HEADERS")
  add_library(${target} OBJECT "${ARG_SOURCE}")
  target_link_libraries(${target} PRIVATE ${ARG_LIBRARIES} vantage_warnings)
  target_precompile_headers(${target} PRIVATE ${ARG_HEADERS})
  # As the executables that use them, not as a library.
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_compile_options(${target} PRIVATE ${vantage_light_options} -fPIE)
endfunction()
