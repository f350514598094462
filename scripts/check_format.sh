#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Fails when clang-format-19 would change a C++ source; `make format` applies it.
set -euo pipefail
cd "$(dirname "$0")/.."

git ls-files --cached --others --exclude-standard '*.h' '*.cpp' '*.cu' '*.cuh' |
  xargs clang-format-19 --dry-run --Werror --ferror-limit=1
echo "format: clean"
