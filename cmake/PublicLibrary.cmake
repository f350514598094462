# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# The library that other programs use: find_package(photoslam), target photoslam::photoslam. One shared object with the
# headers of include/photoslam, which need nothing but the standard library; our dependencies stay inside.
include(CMakePackageConfigHelpers)

file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/api/*.cpp)
list(FILTER sources EXCLUDE REGEX "_test\\.cpp$")
add_library(photoslam_shared SHARED ${sources})
add_library(photoslam::photoslam ALIAS photoslam_shared)
set_target_properties(photoslam_shared PROPERTIES
  OUTPUT_NAME photoslam
  EXPORT_NAME photoslam
  VERSION ${PROJECT_VERSION}
  SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
target_compile_features(photoslam_shared INTERFACE cxx_std_20)
target_include_directories(photoslam_shared PUBLIC
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_link_libraries(photoslam_shared PRIVATE photoslam_evaluation photoslam_options)
target_link_options(photoslam_shared PRIVATE -Wl,--exclude-libs,ALL)

if(PHOTOSLAM_BUILD_TESTS)
  include(GoogleTest)
  add_executable(api_test ${PROJECT_SOURCE_DIR}/src/api/api_test.cpp)
  target_link_libraries(api_test PRIVATE photoslam::photoslam photoslam_options GTest::gmock GTest::gtest_main)
  gtest_discover_tests(api_test DISCOVERY_TIMEOUT 60 PROPERTIES LABELS api)
endif()

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/photoslam)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/photoslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(TARGETS photoslam_shared EXPORT photoslamTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/photoslam DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT photoslamTargets FILE photoslamConfig.cmake NAMESPACE photoslam:: DESTINATION ${package_folder})
install(FILES ${PROJECT_BINARY_DIR}/photoslamConfigVersion.cmake DESTINATION ${package_folder})
