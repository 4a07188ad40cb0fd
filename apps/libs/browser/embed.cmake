# What pages in a browser share: the files beside this one.
set(VANTAGE_BROWSER_DIR "${CMAKE_CURRENT_LIST_DIR}")

# Compiles files into TARGET; <NAME>/assets.hpp declares `vantage::<NAME>::asset`, which returns them by their names.
function(vantage_embed TARGET NAME)
  set(files "")
  foreach(file IN LISTS ARGN)
    get_filename_component(path "${file}" ABSOLUTE)
    list(APPEND files "${path}")
  endforeach()
  list(JOIN files "|" joined)
  set(out "${CMAKE_CURRENT_BINARY_DIR}/assets.cpp")
  add_custom_command(OUTPUT "${out}"
    COMMAND "${CMAKE_COMMAND}" "-DOUT=${out}" "-DNAME=${NAME}" "-DFILES=${joined}"
      -P "${VANTAGE_BROWSER_DIR}/embed_files.cmake"
    DEPENDS ${files} "${VANTAGE_BROWSER_DIR}/embed_files.cmake" VERBATIM)
  target_sources(${TARGET} PRIVATE "${out}")
endfunction()
