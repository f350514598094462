#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Compiles the splatting engine and its unit tests for 64-bit ARM (NEON) with a cross compiler and runs them in an
# emulator. Packages: g++-aarch64-linux-gnu qemu-user libgtest-dev (its sources) libhwy-dev libfmt-dev (their headers).
# Says what is missing and stops without an error where there are no such tools.
# Usage: scripts/test_neon.sh [options of the test program]
set -euo pipefail
cd "$(dirname "$0")/.."

compiler=aarch64-linux-gnu-g++ emulator=qemu-aarch64 googletest=/usr/src/googletest/googletest
for tool in "$compiler" "$emulator"; do
  command -v "$tool" >/dev/null || { echo "test_neon: skipped, no $tool"; exit 0; }
done
for file in "$googletest/src/gtest-all.cc" /usr/include/hwy/highway.h /usr/include/fmt/format.h; do
  [ -f "$file" ] || { echo "test_neon: skipped, no $file"; exit 0; }
done

build=build/neon
mkdir -p "$build/include" "$build/objects"
# These headers are the same for all processors; the other ones of /usr/include are not.
for package in hwy fmt; do ln -sfn "/usr/include/$package" "$build/include/$package"; done

cat >"$build/rules.ninja" <<RULES
builddir = $build
rule cxx
  command = $compiler -std=c++20 -O2 -ffp-contract=off -Wall -Wextra -Werror -DFMT_HEADER_ONLY -DHWY_COMPILE_ONLY_STATIC -DHWY_DISABLE_FUTEX -Isrc -isystem $build/include -isystem $googletest/include -isystem $googletest -MD -MF \$out.d -c \$in -o \$out
  depfile = \$out.d
  deps = gcc
  description = NEON \$in
rule link
  command = $compiler -static -pthread \$in -o \$out
RULES
sources=("$googletest/src/gtest-all.cc" "$googletest/src/gtest_main.cc" src/base/clock.cpp src/base/executor.cpp src/base/module.cpp)
while IFS= read -r file; do sources+=("$file"); done < <(find src/splatting -name '*.cpp' ! -name '*_benchmark.cpp' ! -path '*/cuda/*' ! -path '*/standalone/*' ! -name 'gpu*_test.cpp' | sort)
{
  echo "include $build/rules.ninja"
  objects=()
  for source in "${sources[@]}"; do
    object=$build/objects/$(tr / _ <<<"${source#/}").o
    objects+=("$object")
    echo "build $object: cxx $source"
  done
  echo "build $build/splatting_test: link ${objects[*]}"
} >"$build/build.ninja"
ninja -f "$build/build.ninja" --quiet
"$emulator" "$build/splatting_test" "$@"
