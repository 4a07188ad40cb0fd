# vantage_add_program(<job> SOURCES <file>... [LIBRARIES <target>...]): the program vantage-<job>
function(vantage_add_program job)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "SOURCES;LIBRARIES")
  add_executable(vantage-${job} ${ARG_SOURCES})
  target_link_libraries(vantage-${job} PRIVATE vantage::terminal vantage_warnings ${ARG_LIBRARIES})
  vantage_install_program(vantage-${job})
endfunction()
