#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Compiles the splatting formulas as device code, where there is an nvcc; says so and stops without an error elsewhere.
set -euo pipefail
cd "$(dirname "$0")/.."

nvcc=$(command -v nvcc || true)
[ -n "$nvcc" ] || { [ -x /usr/local/cuda/bin/nvcc ] && nvcc=/usr/local/cuda/bin/nvcc; } || {
  echo "check_device_code: skipped, no nvcc"
  exit 0
}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cat >"$scratch/formulas.cu" <<'CUDA'
#include "splatting/formulas.h"

namespace s = photoslam::splatting::scalar;
using photoslam::splatting::AnchorView;

// One gaussian per thread, forwards and backwards; `values` and `out` are large enough.
__global__ void all_formulas(AnchorView view, const float* values, float* out) {
  const float* v = values + 64 * threadIdx.x;
  s::Projection<float> g;
  s::project(view, v, v + 3, v + 7, g);
  float direction[3], basis[16], by_direction[3], by_offset[3];
  const float inverse = s::normalize(g.offset, direction);
  s::sh_basis(3, direction, basis);
  s::sh_basis_backward(3, direction, v + 10, by_direction);
  s::normalize_backward(direction, inverse, by_direction, by_offset);
  s::ScreenGradient<float> screen{v[26], v[27], v[28], v[29], v[30], v[31]};
  s::GeometryGradient<float> gradient;
  s::project_backward(view, g, screen, by_offset, gradient);
  float* o = out + 64 * threadIdx.x;
  for (int i = 0; i < 16; ++i) o[i] = basis[i];
  for (int i = 0; i < 3; ++i) o[16 + i] = gradient.mean[i] + gradient.log_scale[i];
  for (int i = 0; i < 4; ++i) o[19 + i] = gradient.rotation[i];
  for (int i = 0; i < 6; ++i) o[23 + i] = gradient.pose[i];
}
CUDA
"$nvcc" -std=c++20 -Werror all-warnings -Isrc -c "$scratch/formulas.cu" -o "$scratch/formulas.o"
echo "check_device_code: the formulas compile with $("$nvcc" --version | sed -n 's/.*release \([0-9.]*\).*/nvcc \1/p')"
