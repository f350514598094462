#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Installs the distribution packages that are missing, and says so; quick when there is nothing to do.
# Usage: scripts/install_dependencies.sh [build] [test] [lint]     (default: build)
# Debian 12 is the verified platform. The names are the same on Ubuntu 24.04 (not yet run there).
set -euo pipefail

build_packages=(
  g++ cmake ninja-build ccache mold pkg-config python3 git ca-certificates
  libeigen3-dev libhwy-dev libfmt-dev libjpeg-dev libpng-dev zlib1g-dev
  libcli11-dev libtomlplusplus-dev libyaml-cpp-dev nlohmann-json3-dev
  libembree-dev
  libavformat-dev libavcodec-dev libswscale-dev  # for the module that reads video files
)
test_packages=(libgtest-dev libgmock-dev libbenchmark-dev libceres-dev)
lint_packages=(clang-format-19 clang-tidy-19 libgtest-dev libgmock-dev)

die() {
  echo "install_dependencies: $*" >&2
  exit 1
}

wanted=()
for group in "${@:-build}"; do
  case "$group" in
    build) wanted+=("${build_packages[@]}") ;;
    test) wanted+=("${test_packages[@]}") ;;
    lint) wanted+=("${lint_packages[@]}") ;;
    *) die "unknown group '$group' (build, test or lint)" ;;
  esac
done

command -v dpkg-query >/dev/null ||
  die "no Debian or Ubuntu system; install what these packages contain and run cmake yourself: ${wanted[*]}"

installed=$(dpkg-query --show --showformat='${db:Status-Status} ${Package}\n' | sed -n 's/^installed //p')
missing=()
for package in "${wanted[@]}"; do
  grep --quiet --line-regexp --fixed-strings "$package" <<<"$installed" || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  echo "packages: all there"
  exit 0
fi

echo "packages: installing ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || die "not root and no sudo; run as root: apt-get install ${missing[*]}"
  as_root=(sudo)
fi
if ! apt-get install --simulate --no-install-recommends "${missing[@]}" >/dev/null 2>&1; then
  echo "packages: refreshing the package lists"
  "${as_root[@]}" apt-get update --quiet=2
fi
install() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install --yes --quiet=2 --no-install-recommends "$@" </dev/null
}
# Lists that are a few days old name files that are gone: then refresh them and try once more.
install "${missing[@]}" || { "${as_root[@]}" apt-get update --quiet=2 && install "${missing[@]}"; } ||
  die "apt-get could not install ${missing[*]}"
