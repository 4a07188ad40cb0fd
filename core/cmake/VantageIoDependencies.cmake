# What vantage::io is linked with, for Vantage's own build and for programs that use the installed
# library. Some of these packages bring no CMake package, or one (liblzf) that names a folder that
# does not exist: each of them is an imported target vantage::io_<name> here.
find_package(BZip2 REQUIRED)
find_package(SQLite3 REQUIRED)
find_package(ZLIB REQUIRED)

# vantage_io_dependency(<name> <header> [<folder of the header>])
function(vantage_io_dependency name header)
  find_library(VANTAGE_${name}_LIBRARY ${name} REQUIRED)
  find_path(VANTAGE_${name}_INCLUDE_DIR ${header} PATH_SUFFIXES ${ARGN} REQUIRED)
  mark_as_advanced(VANTAGE_${name}_LIBRARY VANTAGE_${name}_INCLUDE_DIR)
  if(NOT TARGET vantage::io_${name})
    add_library(vantage::io_${name} UNKNOWN IMPORTED)
    set_target_properties(vantage::io_${name} PROPERTIES
      IMPORTED_LOCATION "${VANTAGE_${name}_LIBRARY}"
      INTERFACE_INCLUDE_DIRECTORIES "${VANTAGE_${name}_INCLUDE_DIR}")
  endif()
endfunction()

vantage_io_dependency(GeographicLib GeographicLib/Config.h)
vantage_io_dependency(lz4 lz4frame.h)
vantage_io_dependency(lzf lzf.h liblzf)
vantage_io_dependency(pcap pcap/pcap.h)
vantage_io_dependency(yaml yaml.h)
vantage_io_dependency(zstd zstd.h)
