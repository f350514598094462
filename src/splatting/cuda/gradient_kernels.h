// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "splatting/cuda/blend_kernels.h"

namespace photoslam::splatting::cuda {

/// From records to gradients of the parameters: sums the records of every gaussian in order, goes back through the
/// projection and the spherical harmonics. One thread per slot, one thread block per block of the model.
struct GradientKernel {
  static constexpr int kThreads = kBlockSize;
  struct Shared {
    float pose[kBlockSize][6];
  };
  const Block* blocks;
  const AnchorView* views;
  int sh_degree;
  const uint32_t* tiles;           ///< [slots] instances of a slot
  const uint32_t* first_instance;  ///< [slots]
  const SplatGradient* records;
  float* dense;  ///< [blocks, row::kCount, 64]: zero where nothing was drawn
  float* pose;   ///< [blocks, 6]

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const uint32_t lane = static_cast<uint32_t>(group.thread()), rank = static_cast<uint32_t>(group.block());
    const uint32_t slot = rank * kBlockSize + lane;
    float* out = dense + rank * static_cast<uint32_t>(row::kCount * kBlockSize) + lane;
    for (int i = 0; i < 6; ++i) shared.pose[lane][i] = 0;
    if (tiles[slot] == 0) {
      for (int r = 0; r < row::kCount; ++r) out[r * kBlockSize] = 0;
    } else {
      differentiate(blocks[rank], lane, sum_records(first_instance[slot], tiles[slot]), out, shared.pose[lane]);
    }
    group.sync();
    if (lane >= 6) return;
    float sum = 0;
    for (int i = 0; i < kBlockSize; ++i) sum += shared.pose[i][lane];
    pose[rank * 6 + lane] = sum;
  }

  PHOTOSLAM_DEVICE SplatGradient sum_records(uint32_t first, uint32_t count) const {
    SplatGradient sum = records[first];
    for (uint32_t k = 1; k < count; ++k) {
      const SplatGradient& next = records[first + k];
      sum.t += next.t;
      sum.dy += next.dy;
      sum.tt += next.tt;
      sum.t_dy += next.t_dy;
      sum.dy_dy += next.dy_dy;
      sum.one += next.one;
      for (int c = 0; c < 3; ++c) sum.rgb[c] += next.rgb[c];
      sum.z += next.z;
      sum.weight += next.weight;
      sum.max_weight = fmaxf(sum.max_weight, next.max_weight);
    }
    return sum;
  }

  PHOTOSLAM_DEVICE void differentiate(const Block& block, uint32_t lane, const SplatGradient& sum, float* out,
                                      float* twist) const {
    const AnchorView& view = views[block.anchor];
    float mean[3], rotation[4], log_scale[3];
    for (int i = 0; i < 3; ++i) mean[i] = block.parameters[row::kMean + i][lane];
    for (int i = 0; i < 4; ++i) rotation[i] = block.parameters[row::kRotation + i][lane];
    for (int i = 0; i < 3; ++i) log_scale[i] = block.parameters[row::kLogScale + i][lane];
    scalar::Projection<float> g;
    scalar::project(view, mean, rotation, log_scale, g);
    // e = covariance⁻¹ (pixel − position): e.x = a1 t, e.y = c1 dy − slope a1 t.
    const float c1 = 1.0f / g.c, a1 = g.c / g.det, along = g.b * c1 * a1;
    scalar::ScreenGradient<float> s;
    s.u = a1 * sum.t;
    s.v = c1 * sum.dy - along * sum.t;
    s.exx = a1 * a1 * sum.tt;
    s.exy = a1 * (c1 * sum.t_dy - along * sum.tt);
    s.eyy = c1 * c1 * sum.dy_dy + along * (along * sum.tt - (c1 + c1) * sum.t_dy);
    s.z = sum.z;

    const int coefficients = (sh_degree + 1) * (sh_degree + 1);
    float direction[3], basis[kNumShCoefficients], weights[kNumShCoefficients] = {}, color[3] = {0.5f, 0.5f, 0.5f};
    const float inverse = scalar::normalize(g.offset, direction);
    scalar::sh_basis(sh_degree, direction, basis);
    for (int k = 0; k < coefficients; ++k)
      for (int c = 0; c < 3; ++c) color[c] = fmaf(basis[k], block.parameters[row::kSh + 3 * k + c][lane], color[c]);
    for (int c = 0; c < 3; ++c) color[c] = color[c] > 0 ? sum.rgb[c] : 0.0f;  // from here: dL/d(colour)
    for (int k = 0; k < coefficients; ++k)
      for (int c = 0; c < 3; ++c) weights[k] = fmaf(color[c], block.parameters[row::kSh + 3 * k + c][lane], weights[k]);
    float direction_gradient[3], offset_gradient[3];
    scalar::sh_basis_backward(sh_degree, direction, weights, direction_gradient);
    scalar::normalize_backward(direction, inverse, direction_gradient, offset_gradient);

    scalar::GeometryGradient<float> gradient;
    scalar::project_backward(view, g, s, offset_gradient, gradient);
    for (int i = 0; i < 3; ++i) out[(row::kMean + i) * kBlockSize] = gradient.mean[i];
    for (int i = 0; i < 4; ++i) out[(row::kRotation + i) * kBlockSize] = gradient.rotation[i];
    for (int i = 0; i < 3; ++i) out[(row::kLogScale + i) * kBlockSize] = gradient.log_scale[i];
    const float opacity = 1.0f / (1.0f + expf(fminf(-block.parameters[row::kOpacity][lane], 80.0f)));
    out[row::kOpacity * kBlockSize] = (1.0f - opacity) * sum.one;
    for (int k = 0; k < kNumShCoefficients; ++k)
      for (int c = 0; c < 3; ++c)
        out[(row::kSh + 3 * k + c) * kBlockSize] = k < coefficients ? basis[k] * color[c] : 0.0f;
    for (int i = 0; i < 6; ++i) twist[i] = gradient.pose[i];
  }
};

}  // namespace photoslam::splatting::cuda
