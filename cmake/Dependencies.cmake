# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
# Distribution packages only; nothing is fetched at build time.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)

find_package(fmt REQUIRED)
find_package(JPEG REQUIRED)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(CLI11 REQUIRED)
# Embree 4 where there is one, else Embree 3: the sources take either.
find_package(embree 4 QUIET)
if(NOT embree_FOUND)
  find_package(embree 3 REQUIRED)
endif()

find_package(PkgConfig REQUIRED)
pkg_check_modules(hwy REQUIRED IMPORTED_TARGET libhwy)

if(PHOTOSLAM_BUILD_TESTS)
  find_package(GTest REQUIRED)
  # Test oracle only, never linked into the product.
  find_package(Ceres QUIET)
endif()
if(PHOTOSLAM_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()
