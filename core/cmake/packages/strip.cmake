# What CPack has gathered, before it becomes packages: a program finds its libraries where Debian has them, so it names
# no folder of its own; static libraries lose what only debuggers read.
file(GLOB_RECURSE files LIST_DIRECTORIES OFF "${CPACK_TEMPORARY_DIRECTORY}/*")
find_program(STRIP strip REQUIRED)
foreach(file IN LISTS files)
  if(IS_SYMLINK "${file}")
    continue()
  endif()
  file(READ "${file}" magic LIMIT 8 HEX)
  if(magic MATCHES "^7f454c46")
    file(RPATH_REMOVE FILE "${file}")
    execute_process(COMMAND "${STRIP}" --strip-unneeded --remove-section=.comment --remove-section=.note "${file}"
      COMMAND_ERROR_IS_FATAL ANY)
  elseif(magic STREQUAL "213c617263683e0a")
    execute_process(COMMAND "${STRIP}" --strip-debug --enable-deterministic-archives --remove-section=.comment "${file}"
      COMMAND_ERROR_IS_FATAL ANY)
  endif()
endforeach()
