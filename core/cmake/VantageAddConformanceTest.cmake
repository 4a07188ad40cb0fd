# vantage_add_conformance_test(<plugin target> PARAMS <file> [NAME <test>] [SEED <number>])
#
# A ctest that holds the plugin to the contract of its kind, with the [params] and [claims] of the
# file. The test is called conformance_<plugin target> unless NAME says otherwise.
function(vantage_add_conformance_test plugin)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "PARAMS;NAME;SEED" "")
  if(NOT TARGET ${plugin})
    message(FATAL_ERROR "vantage_add_conformance_test: '${plugin}' is no target; expected one made by vantage_add_plugin")
  endif()
  if(NOT ARG_PARAMS)
    message(FATAL_ERROR "vantage_add_conformance_test(${plugin}): PARAMS <file> is missing")
  endif()
  if(NOT ARG_NAME)
    set(ARG_NAME conformance_${plugin})
  endif()
  get_filename_component(params "${ARG_PARAMS}" ABSOLUTE)
  set(seed)
  if(DEFINED ARG_SEED)
    set(seed --seed ${ARG_SEED})
  endif()
  add_test(NAME ${ARG_NAME}
    COMMAND vantage::conformance_program "$<TARGET_FILE:${plugin}>" "${params}" ${seed})
endfunction()
