# vantage_needs(<package> <what>)
#
# Finds a package that is not needed everywhere. Where it is not installed, <what> is left out: the rest
# of the calling file is skipped.
macro(vantage_needs package what)
  find_package(${package} QUIET)
  if(NOT ${package}_FOUND)
    message(STATUS "${what} is left out: ${package} is not installed")
    return()
  endif()
endmacro()
