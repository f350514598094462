#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Configures build/PRESET quietly: the output is shown only when it fails.
# Usage: scripts/configure.sh PRESET [cmake options]
set -euo pipefail
cd "$(dirname "$0")/.."

echo "cmake: configuring build/$1"
if ! output=$(cmake --preset "$@" 2>&1); then
  echo "$output" >&2
  exit 1
fi
