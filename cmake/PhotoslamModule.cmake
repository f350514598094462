# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
# photoslam_module(<name> [DEPENDS <module or library>...] [PRIVATE <library>...] [TEST_DEPENDS <library>...])
#
# Turns src/<name> into the static library photoslam_<name> (all *.cpp but *_test.cpp and *_benchmark.cpp)
# and its *_test.cpp into the executable <name>_test, registered with CTest one case at a time.
function(photoslam_module name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;PRIVATE;TEST_DEPENDS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/standalone/")  # has a build of its own
  set(tests ${sources})
  set(benchmarks ${sources})
  list(FILTER tests INCLUDE REGEX "_test\\.cpp$")
  list(FILTER benchmarks INCLUDE REGEX "_benchmark\\.cpp$")
  list(FILTER sources EXCLUDE REGEX "_(test|benchmark)\\.cpp$")

  set(library photoslam_${name})
  if(sources)
    add_library(${library} STATIC ${sources})
    target_include_directories(${library} PUBLIC ${PROJECT_SOURCE_DIR}/src)
    target_link_libraries(${library} PUBLIC ${ARG_DEPENDS} PRIVATE photoslam_options ${ARG_PRIVATE})
  else()
    add_library(${library} INTERFACE)
    target_include_directories(${library} INTERFACE ${PROJECT_SOURCE_DIR}/src)
    target_link_libraries(${library} INTERFACE ${ARG_DEPENDS})
  endif()

  if(PHOTOSLAM_BUILD_TESTS AND tests)
    add_executable(${name}_test ${tests})
    target_link_libraries(${name}_test PRIVATE ${library} photoslam_options ${ARG_PRIVATE} ${ARG_TEST_DEPENDS}
                          GTest::gmock GTest::gtest_main)
    include(GoogleTest)
    gtest_discover_tests(${name}_test DISCOVERY_TIMEOUT 60 PROPERTIES LABELS ${name})
  endif()
  if(PHOTOSLAM_BUILD_BENCHMARKS AND benchmarks)
    add_executable(${name}_benchmark ${benchmarks})
    target_link_libraries(${name}_benchmark PRIVATE ${library} photoslam_options ${ARG_PRIVATE} ${ARG_TEST_DEPENDS}
                          benchmark::benchmark_main)
  endif()
endfunction()
