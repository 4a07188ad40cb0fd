# vantage_add_plugin(<kind> <name> SOURCES <file>... [LIBRARIES <target>...])
#
# Builds vantage_<kind>_<name>.so, which exports the manifest symbol `vantage_plugin` and nothing else.
# Kinds: partitioner, ground, visibility, store, matcher, selector, relocalizer. The target has the name of the file.
function(vantage_add_plugin kind name)
  cmake_parse_arguments(PARSE_ARGV 2 ARG "" "" "SOURCES;LIBRARIES")
  set(kinds partitioner ground visibility store matcher selector relocalizer)
  if(NOT kind IN_LIST kinds)
    message(FATAL_ERROR "vantage_add_plugin: no kind '${kind}'; expected one of ${kinds}")
  endif()
  if(NOT ARG_SOURCES)
    message(FATAL_ERROR "vantage_add_plugin(${kind} ${name}): SOURCES <file>... is missing")
  endif()
  set(target vantage_${kind}_${name})
  set(exports "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/plugin.map")
  add_library(${target} MODULE ${ARG_SOURCES})
  target_link_libraries(${target} PRIVATE vantage::core vantage::kit ${ARG_LIBRARIES})
  if(TARGET vantage_warnings)
    target_link_libraries(${target} PRIVATE vantage_warnings)
  endif()
  set_target_properties(${target} PROPERTIES
    PREFIX "" OUTPUT_NAME ${target}
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
    INSTALL_RPATH "$ORIGIN/.."
    LINK_DEPENDS "${exports}")
  # nodelete: a TBB worker may still be on its way out of a task's code here when parallel_for has
  # returned and the caller lets the plugin go, so the code stays mapped.
  target_link_options(${target} PRIVATE
    "LINKER:--version-script=${exports}" LINKER:--as-needed LINKER:-z,nodelete)
  if(VANTAGE_PLUGIN_OUTPUT_DIRECTORY)
    set_target_properties(${target} PROPERTIES
      LIBRARY_OUTPUT_DIRECTORY "${VANTAGE_PLUGIN_OUTPUT_DIRECTORY}")
  endif()
endfunction()
