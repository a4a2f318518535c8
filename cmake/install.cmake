# SPDX-License-Identifier: BSD-3-Clause
# The package: headers, and what find_package(jml) and pkg-config read. Nothing in it depends on this machine or its
# processor. Also where jml is a part of another project: a library that links jml::jml and is exported needs jml in an
# export set, in the install tree and in the build tree.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(package_folder ${CMAKE_INSTALL_DATADIR}/cmake/jml)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME jml)  # cmake --install <build> --component jml

install(TARGETS jml EXPORT jmlTargets FILE_SET HEADERS)
install(EXPORT jmlTargets NAMESPACE jml:: DESTINATION ${package_folder})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/jmlConfig.cmake.in ${PROJECT_BINARY_DIR}/jmlConfig.cmake
                              INSTALL_DESTINATION ${package_folder} NO_SET_AND_CHECK_MACRO)
# Before 1.0 a new minor version may break its users.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/jmlConfigVersion.cmake VERSION ${PROJECT_VERSION}
                                 COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${PROJECT_BINARY_DIR}/jmlConfig.cmake ${PROJECT_BINARY_DIR}/jmlConfigVersion.cmake DESTINATION ${package_folder})
install(FILES ${CMAKE_CURRENT_LIST_DIR}/components.cmake DESTINATION ${package_folder} RENAME jmlComponents.cmake)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/jml)

# The build tree is a package as well: -D jml_DIR=<build>.
export(EXPORT jmlTargets NAMESPACE jml:: FILE ${PROJECT_BINARY_DIR}/jmlTargets.cmake)
configure_file(${CMAKE_CURRENT_LIST_DIR}/components.cmake ${PROJECT_BINARY_DIR}/jmlComponents.cmake COPYONLY)

# jml.pc finds its prefix from where it stands, so that an installed tree can be moved.
set(pc_folder ${CMAKE_INSTALL_DATADIR}/pkgconfig)
cmake_path(IS_ABSOLUTE CMAKE_INSTALL_DATADIR data_is_absolute)
if(data_is_absolute)
  set(prefix_in_pc ${CMAKE_INSTALL_PREFIX})
else()
  file(RELATIVE_PATH up /prefix/${pc_folder} /prefix)
  string(REGEX REPLACE "/$" "" prefix_in_pc "\${pcfiledir}/${up}")
endif()
cmake_path(IS_ABSOLUTE CMAKE_INSTALL_INCLUDEDIR include_is_absolute)
if(include_is_absolute)
  set(includedir_in_pc ${CMAKE_INSTALL_INCLUDEDIR})
else()
  set(includedir_in_pc "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/jml.pc.in ${PROJECT_BINARY_DIR}/jml.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/jml.pc DESTINATION ${pc_folder})
