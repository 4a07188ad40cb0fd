# The Debian packages, made by the target `packages` (./dev package) for the system that it runs on:
#
#   vantage-robot   component robot: what localizes on a robot
#   vantage         component programs: all other programs and plugins; needs vantage-robot
#   libvantage-dev  component dev: what programs and plugins of others are built with; needs vantage
#
# What only a package has (manuals, the unit of systemd) is not installed by `cmake --install`.
set(VANTAGE_PACKAGE_MAINTAINER "Vantage developers <vantage@packages.invalid>" CACHE STRING
  "Who makes the Debian packages: NAME <ADDRESS>")
set(vantage_package_files "${CMAKE_CURRENT_LIST_DIR}/packages")
set(vantage_packages_of_robot vantage-robot)
set(vantage_packages_of_programs vantage)
set(vantage_packages_of_dev libvantage-dev)

# vantage_install_into_packages(<component> <folder> <file>...)
function(vantage_install_into_packages component folder)
  install(FILES ${ARGN} DESTINATION "${folder}" COMPONENT ${component} EXCLUDE_FROM_ALL)
endfunction()

# The manual of each program of the component, from its help; written by the target `packages`.
function(vantage_manuals component)
  get_property(programs GLOBAL PROPERTY vantage_programs_of_${component})
  set(manuals)
  foreach(program IN LISTS programs)
    set(manual "${PROJECT_BINARY_DIR}/packages/man/${program}.1")
    add_custom_command(OUTPUT "${manual}.gz"
      COMMAND sh "${vantage_package_files}/manual.sh" "$<TARGET_FILE:${program}>" "${PROJECT_VERSION}"
        "${packages_epoch}" "${manual}"
      DEPENDS ${program} "${vantage_package_files}/manual.sh"
      COMMENT "Manual of ${program}" VERBATIM)
    list(APPEND manuals "${manual}.gz")
  endforeach()
  vantage_install_into_packages(${component} "${CMAKE_INSTALL_MANDIR}/man1" ${manuals})
  set_property(GLOBAL APPEND PROPERTY vantage_made_for_packages ${manuals})
endfunction()

# The changelog of the package and its copyright.
function(vantage_package_texts component release)
  set(package ${vantage_packages_of_${component}})
  set(folder "${PROJECT_BINARY_DIR}/packages/${package}")
  file(TIMESTAMP "${PROJECT_SOURCE_DIR}/CHANGELOG.md" date "%a, %d %b %Y %H:%M:%S +0000" UTC)
  configure_file("${vantage_package_files}/changelog.in" "${folder}/changelog.Debian" @ONLY)
  configure_file("${vantage_package_files}/copyright" "${folder}/copyright" COPYONLY)
  add_custom_command(OUTPUT "${folder}/changelog.Debian.gz"
    COMMAND gzip -9nkf changelog.Debian DEPENDS "${folder}/changelog.Debian" WORKING_DIRECTORY "${folder}" VERBATIM)
  set_property(GLOBAL APPEND PROPERTY vantage_made_for_packages "${folder}/changelog.Debian.gz")
  vantage_install_into_packages(${component} "${CMAKE_INSTALL_DATADIR}/doc/${package}"
    "${folder}/changelog.Debian.gz" "${folder}/copyright")
endfunction()

# After all rules of programs, plugins and libraries.
function(vantage_debian_packages)
  if(NOT CMAKE_INSTALL_LIBDIR STREQUAL "lib/${CMAKE_LIBRARY_ARCHITECTURE}")
    message(STATUS "No Debian packages: libraries are installed into ${CMAKE_INSTALL_LIBDIR}, not into "
      "lib/${CMAKE_LIBRARY_ARCHITECTURE}")
    return()
  endif()
  cmake_host_system_information(RESULT system QUERY DISTRIB_INFO)
  if(NOT system_ID MATCHES "^(debian|ubuntu)$")
    message(STATUS "No Debian packages: this system is neither Debian nor Ubuntu")
    return()
  endif()
  string(REPLACE "debian" "deb" release "1~${system_ID}${system_VERSION_ID}")
  set(version "${PROJECT_VERSION}-${release}")
  file(TIMESTAMP "${PROJECT_SOURCE_DIR}/CHANGELOG.md" packages_epoch "%s" UTC)

  foreach(component IN ITEMS robot programs dev)
    vantage_manuals(${component})
    vantage_package_texts(${component} ${release})
  endforeach()
  vantage_install_into_packages(robot lib/systemd/system "${vantage_package_files}/vantage-live.service")
  vantage_install_into_packages(robot "${CMAKE_INSTALL_DATADIR}/doc/vantage-robot/examples"
    "${vantage_package_files}/live.toml")

  set(CPACK_GENERATOR DEB)
  set(CPACK_COMPONENTS_ALL robot programs dev)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
  set(CPACK_PACKAGE_CONTACT "${VANTAGE_PACKAGE_MAINTAINER}")
  set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
  set(CPACK_PACKAGE_VERSION "${PROJECT_VERSION}")
  set(CPACK_PACKAGE_DIRECTORY "${PROJECT_BINARY_DIR}/packages")
  set(CPACK_STRIP_FILES ON)
  set(CPACK_PRE_BUILD_SCRIPTS "${vantage_package_files}/strip.cmake")
  set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_RELEASE "${release}")
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CMAKE_LIBRARY_OUTPUT_DIRECTORY}")
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
  set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)

  set(CPACK_DEBIAN_ROBOT_PACKAGE_NAME vantage-robot)
  set(CPACK_DEBIAN_ROBOT_PACKAGE_SECTION science)
  set(CPACK_COMPONENT_ROBOT_DESCRIPTION "localizes a LiDAR in region maps, on a robot
Tells a robot with a LiDAR where it is in a point cloud map of a campus or a
city, without loading the whole map. It is a node of ROS 2 to others, over
DDS, and needs no part of ROS.

This package has what a robot needs: the programs vantage, vantage-live,
vantage-localize and vantage-info, with the plugins that they load, and a
unit of systemd. The package vantage builds the maps.")
  set(control postinst prerm postrm triggers)
  list(TRANSFORM control PREPEND "${vantage_package_files}/" OUTPUT_VARIABLE CPACK_DEBIAN_ROBOT_PACKAGE_CONTROL_EXTRA)
  set(CPACK_DEBIAN_ROBOT_PACKAGE_CONTROL_STRICT_PERMISSION ON)

  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME vantage)
  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_DEPENDS "vantage-robot (= ${version})")
  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_CONTROL_EXTRA "${vantage_package_files}/triggers")
  set(CPACK_DEBIAN_PROGRAMS_PACKAGE_CONTROL_STRICT_PERMISSION ON)
  set(CPACK_COMPONENT_PROGRAMS_DESCRIPTION "cuts point cloud maps into regions to localize a LiDAR in
Cuts a point cloud map of a campus or a city into regions, and keeps for each
the points that a sensor on its ground could see. A robot then localizes its
LiDAR with the map of its region.

This package builds, assesses, evaluates, exports and shows such maps. The
package vantage-robot, which it needs, localizes in them.")

  set(CPACK_DEBIAN_DEV_PACKAGE_NAME libvantage-dev)
  set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
  string(JOIN ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
    "vantage (= ${version})" libeigen3-dev libexpected-dev libtbb-dev libfmt-dev doctest-dev
    libbz2-dev libgeographiclib-dev liblz4-dev liblzf-dev libpcap-dev libsqlite3-dev libyaml-dev libzstd-dev
    zlib1g-dev)
  set(CPACK_COMPONENT_DEV_DESCRIPTION "headers and libraries of Vantage, and tests of its plugins
What programs that localize a LiDAR by Vantage, and plugins of it, are built
with: headers, static libraries, a package of CMake, examples, and the suites
that test whether a plugin keeps the contract of its kind.")
  include(CPack)

  find_program(VANTAGE_HELP2MAN help2man)
  find_program(VANTAGE_SHLIBDEPS dpkg-shlibdeps)
  if(NOT VANTAGE_HELP2MAN OR NOT VANTAGE_SHLIBDEPS)
    message(STATUS "No Debian packages: help2man or dpkg-dev is not installed")
    return()
  endif()
  get_property(made GLOBAL PROPERTY vantage_made_for_packages)
  get_property(plugins GLOBAL PROPERTY vantage_shipped_plugins)
  add_custom_target(packages
    COMMAND "${CMAKE_COMMAND}" -E env "SOURCE_DATE_EPOCH=${packages_epoch}" "${CMAKE_CPACK_COMMAND}"
      --config "${PROJECT_BINARY_DIR}/CPackConfig.cmake"
    DEPENDS ${made} ${plugins} vantage_conformance vantage_evaluation vantage_io vantage_kit vantage_track
    COMMENT "Debian packages" VERBATIM)
endfunction()
