# SPDX-License-Identifier: BSD-3-Clause
# The package: headers, and what find_package(jml) reads. Nothing in it depends on this machine or its processor.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(package_folder ${CMAKE_INSTALL_DATADIR}/cmake/jml)

install(TARGETS jml EXPORT jmlTargets FILE_SET HEADERS)
install(EXPORT jmlTargets NAMESPACE jml:: DESTINATION ${package_folder})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/jmlConfig.cmake.in ${PROJECT_BINARY_DIR}/jmlConfig.cmake
                              INSTALL_DESTINATION ${package_folder} NO_SET_AND_CHECK_MACRO)
# Before 1.0 a new minor version may break its users.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/jmlConfigVersion.cmake COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${PROJECT_BINARY_DIR}/jmlConfig.cmake ${PROJECT_BINARY_DIR}/jmlConfigVersion.cmake DESTINATION ${package_folder})
install(FILES ${CMAKE_CURRENT_LIST_DIR}/components.cmake DESTINATION ${package_folder} RENAME jmlComponents.cmake)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
