# vantage_needs(<package> <what>)
#
# Finds a package that is not needed everywhere. Where it is not installed, <what> is left out: the rest
# of the calling file is skipped. A build with tests must have it.
macro(vantage_needs package what)
  if(VANTAGE_BUILD_TESTS)
    find_package(${package} REQUIRED)
  else()
    find_package(${package} QUIET)
  endif()
  if(NOT ${package}_FOUND)
    message(STATUS "${what} is left out: ${package} is not installed")
    return()
  endif()
endmacro()
