# What `cmake --install` puts under a prefix that can be moved anywhere: programs, libraries, plugins,
# headers, and the package that find_package(vantage) finds.
#
# Each rule belongs to the component of the Debian package that has it (VantagePackages.cmake): robot, programs or
# dev; dev, unless a rule says otherwise.

# Debian's folder for libraries, below any prefix, so that a package holds what an installation holds.
if(NOT DEFINED CMAKE_INSTALL_LIBDIR AND CMAKE_LIBRARY_ARCHITECTURE)
  set(CMAKE_INSTALL_LIBDIR "lib/${CMAKE_LIBRARY_ARCHITECTURE}" CACHE PATH "Folder of libraries below the prefix")
endif()
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME dev)

set(VANTAGE_INSTALL_PLUGIN_DIR "${CMAKE_INSTALL_LIBDIR}/vantage")
set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/vantage")

# vantage_install_program(<target> [<component>]): of the component programs, unless another is named
function(vantage_install_program target)
  set(component ${ARGN})
  if(NOT component)
    set(component programs)
  endif()
  set_property(GLOBAL APPEND PROPERTY vantage_programs_of_${component} ${target})
  file(RELATIVE_PATH from_bin_to_lib "/${CMAKE_INSTALL_BINDIR}" "/${CMAKE_INSTALL_LIBDIR}")
  set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/${from_bin_to_lib}")
  install(TARGETS ${target} EXPORT vantageTargets
    RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT ${component})
endfunction()

# vantage_install_shared_library(<target> <name> <component>): vantage::<name>, of that component, with the headers of
# include/. It exports what VANTAGE_API marks, and finds the others beside it.
function(vantage_install_shared_library target name component)
  set_target_properties(${target} PROPERTIES
    EXPORT_NAME ${name}
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
    INSTALL_RPATH "$ORIGIN"
    VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  install(TARGETS ${target} EXPORT vantageTargets
    LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT ${component} NAMELINK_COMPONENT dev)
  install(DIRECTORY include/vantage DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
endfunction()

function(vantage_install_package)
  install(EXPORT vantageTargets NAMESPACE vantage:: DESTINATION "${package_dir}")
  install(EXPORT vantageConformanceTargets NAMESPACE vantage:: DESTINATION "${package_dir}")
  install(EXPORT vantageIoTargets NAMESPACE vantage:: DESTINATION "${package_dir}")
  install(EXPORT vantageEvaluationTargets NAMESPACE vantage:: DESTINATION "${package_dir}")
  configure_package_config_file("${PROJECT_SOURCE_DIR}/core/cmake/vantageConfig.cmake.in"
    "${PROJECT_BINARY_DIR}/cmake/vantageConfig.cmake"
    INSTALL_DESTINATION "${package_dir}" PATH_VARS VANTAGE_INSTALL_PLUGIN_DIR)
  write_basic_package_version_file("${PROJECT_BINARY_DIR}/cmake/vantageConfigVersion.cmake"
    COMPATIBILITY SameMinorVersion)
  install(FILES
    "${PROJECT_BINARY_DIR}/cmake/vantageConfig.cmake"
    "${PROJECT_BINARY_DIR}/cmake/vantageConfigVersion.cmake"
    "${PROJECT_SOURCE_DIR}/core/cmake/VantageAddPlugin.cmake"
    "${PROJECT_SOURCE_DIR}/core/cmake/VantageAddConformanceTest.cmake"
    "${PROJECT_SOURCE_DIR}/core/cmake/VantageIoDependencies.cmake"
    "${PROJECT_SOURCE_DIR}/core/cmake/plugin.map"
    DESTINATION "${package_dir}")
  install(FILES "${PROJECT_SOURCE_DIR}/LICENSE"
    DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT license)  # packages have a file `copyright`
  install(FILES
    "${PROJECT_SOURCE_DIR}/docs/config_reference.md"
    "${PROJECT_SOURCE_DIR}/docs/contracts.md"
    "${PROJECT_SOURCE_DIR}/docs/plugin_author.md"
    DESTINATION "${CMAKE_INSTALL_DOCDIR}")
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/docs/examples/"
    DESTINATION "${CMAKE_INSTALL_DATADIR}/vantage/examples")
endfunction()
