# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
# Flags shared by every photoslam target, as the interface target photoslam_options.
add_library(photoslam_options INTERFACE)
target_compile_options(photoslam_options INTERFACE
  -Wall -Wextra -Wconversion -Wshadow -Wnon-virtual-dtor -Werror
  # Fused multiply-add contraction would make results depend on the optimiser's mood.
  -ffp-contract=off)
if(PHOTOSLAM_SANITIZE)
  # With sanitizers GCC sees members of a variant that is not there used uninitialised; it documents such mistakes.
  target_compile_options(photoslam_options INTERFACE
    -Wno-maybe-uninitialized
    -fsanitize=${PHOTOSLAM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(photoslam_options INTERFACE -fsanitize=${PHOTOSLAM_SANITIZE})
endif()

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()
find_program(MOLD_PROGRAM mold)
if(MOLD_PROGRAM AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_link_options(-fuse-ld=mold)
endif()
