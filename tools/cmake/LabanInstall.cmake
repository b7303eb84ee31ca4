# Installs headers, libraries and a versioned CMake package: find_package(laban) gives laban::transfer
# and the modules below it.
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/laban)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/laban DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT laban-targets NAMESPACE laban:: DESTINATION ${package_folder})
configure_package_config_file(
  ${PROJECT_SOURCE_DIR}/tools/cmake/laban-config.cmake.in ${PROJECT_BINARY_DIR}/laban-config.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(
  ${PROJECT_BINARY_DIR}/laban-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/laban-config.cmake ${PROJECT_BINARY_DIR}/laban-config-version.cmake
        DESTINATION ${package_folder})
