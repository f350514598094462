// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "splatting/cuda/blend_kernels.h"
#include "splatting/update_constants.h"

namespace photoslam::splatting::cuda {

/// From records to parameters: sums the records of every gaussian in order, goes back through the projection and the
/// spherical harmonics, and lets Adam use the gradients at once, or writes them out. One thread per slot, one thread
/// block per block of the model. What the records of drawn gaussians hold is what the CPU's update_model() sees.
struct UpdateKernel {
  static constexpr int kThreads = kBlockSize;
  struct Shared {
    float pose[6][kBlockSize];
  };
  Block* blocks;
  const AnchorView* views;
  Extent image;
  int sh_degree;
  const uint32_t* tiles;           ///< [slots] instances of a slot
  const uint32_t* first_instance;  ///< [slots]
  const SplatGradient* records;
  const uint32_t* num_instances;  ///< Records from here on do not exist.
  const uint32_t* lost;           ///< Instances without room: unless tolerated, the model stays as it is.
  const uint32_t* num_visible;
  bool tolerate_lost;
  bool update;  ///< Parameters, optimiser state and statistics.
  UpdateConstants constants;
  float* dense;  ///< [blocks, row::kCount, 64]: zero where nothing was drawn; or null
  float* pose;   ///< [6, blocks]

  /// The gradients of one gaussian; those of the colour coefficients are products basis x colour.
  struct Gradient {
    scalar::GeometryGradient<float> geometry;
    float opacity;
    float basis[kNumShCoefficients];
    float color[3];
  };

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const uint32_t lane = static_cast<uint32_t>(group.thread()), rank = static_cast<uint32_t>(group.block());
    const uint32_t slot = rank * kBlockSize + lane, count = tiles[slot];
    float* out = dense == nullptr ? nullptr : dense + size_t{rank} * row::kCount * kBlockSize + lane;
    for (int i = 0; i < 6; ++i) shared.pose[i][lane] = 0;
    for (int r = 0; out != nullptr && r < row::kCount; ++r) out[r * kBlockSize] = 0;
    if (count > 0 && (*lost == 0 || tolerate_lost)) {
      Block& block = blocks[rank];
      const SplatGradient sum = sum_records(first_instance[slot], count);
      Gradient gradient;
      scalar::ScreenGradient<float> screen;
      if (differentiate(block, lane, sum, screen, gradient)) {
        for (int i = 0; i < 6; ++i) shared.pose[i][lane] = gradient.geometry.pose[i];
        if (out != nullptr) write(gradient, out);
        if (update) {
          update_statistics(block, lane, sum, screen);
          optimize(block, lane, gradient);
        }
      }
    }
    group.sync();
    if (lane >= 6) return;
    float total = 0;
    for (int i = 0; i < kBlockSize; ++i) total += shared.pose[lane][i];
    pose[lane * static_cast<uint32_t>(group.num_blocks()) + rank] = total;
  }

  PHOTOSLAM_DEVICE SplatGradient sum_records(uint32_t first, uint32_t count) const {
    SplatGradient sum{};
    const uint32_t end = *num_instances;
    for (uint32_t k = first; k < end && k - first < count; ++k) {
      const SplatGradient next = records[k];
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

  /// False: a gradient is absurd or not a number; the gaussian is to be left alone.
  PHOTOSLAM_DEVICE bool differentiate(const Block& block, uint32_t lane, const SplatGradient& sum,
                                      scalar::ScreenGradient<float>& s, Gradient& out) const {
    const AnchorView& view = views[block.anchor];
    const scalar::Projection<float> g = project_lane(block, lane, view);
    s = scalar::screen_gradient<float>(view, g, {sum.one, sum.t, sum.dy, sum.tt, sum.t_dy, sum.dy_dy, sum.z});
    const float size = fabsf(s.u) + fabsf(s.v) + fabsf(s.exx) + fabsf(s.eyy) + fabsf(s.exy) + fabsf(s.z) +
                       fabsf(sum.rgb[0]) + fabsf(sum.rgb[1]) + fabsf(sum.rgb[2]);
    if (!(size < kAbsurd)) return false;

    const int coefficients = num_coefficients();
    float direction[3], weights[kNumShCoefficients] = {}, color[3] = {0.5f, 0.5f, 0.5f};
    const float inverse = scalar::normalize(g.offset, direction);
    scalar::sh_basis(sh_degree, direction, out.basis);
    for (int k = 0; k < coefficients; ++k)
      for (int c = 0; c < 3; ++c) color[c] = fmaf(out.basis[k], block.parameters[row::kSh + 3 * k + c][lane], color[c]);
    for (int c = 0; c < 3; ++c) out.color[c] = color[c] > 0 ? sum.rgb[c] : 0.0f;
    for (int k = 0; k < coefficients; ++k)
      for (int c = 0; c < 3; ++c)
        weights[k] = fmaf(out.color[c], block.parameters[row::kSh + 3 * k + c][lane], weights[k]);
    float direction_gradient[3], offset_gradient[3];
    scalar::sh_basis_backward(sh_degree, direction, weights, direction_gradient);
    scalar::normalize_backward(direction, inverse, direction_gradient, offset_gradient);
    scalar::project_backward(view, g, s, offset_gradient, out.geometry);

    const float opacity = 1.0f / (1.0f + expf(fminf(-block.parameters[row::kOpacity][lane], 80.0f)));
    const float visible = static_cast<float>(*num_visible > 0 ? *num_visible : 1);
    out.opacity = (1.0f - opacity) * fmaf(opacity, constants.opacity_weight / visible, sum.one);
    return true;
  }

  PHOTOSLAM_DEVICE int num_coefficients() const { return (sh_degree + 1) * (sh_degree + 1); }

  /// Calls f(row, gradient) for every row in use.
  template <class F>
  PHOTOSLAM_DEVICE void for_each_row(const Gradient& gradient, F&& f) const {
    for (int i = 0; i < 3; ++i) f(row::kMean + i, gradient.geometry.mean[i]);
    for (int i = 0; i < 4; ++i) f(row::kRotation + i, gradient.geometry.rotation[i]);
    for (int i = 0; i < 3; ++i) f(row::kLogScale + i, gradient.geometry.log_scale[i]);
    f(row::kOpacity, gradient.opacity);
    for (int k = 0; k < num_coefficients(); ++k)
      for (int c = 0; c < 3; ++c) f(row::kSh + 3 * k + c, gradient.basis[k] * gradient.color[c]);
  }

  PHOTOSLAM_DEVICE void write(const Gradient& gradient, float* out) const {
    for_each_row(gradient, [&](int r, float value) { out[r * kBlockSize] = value; });
  }

  PHOTOSLAM_DEVICE void update_statistics(Block& block, uint32_t lane, const SplatGradient& sum,
                                          const scalar::ScreenGradient<float>& s) const {
    const float gu = s.u * 0.5f * static_cast<float>(image.width), gv = s.v * 0.5f * static_cast<float>(image.height);
    block.gradient[lane] += sqrtf(fmaf(gu, gu, gv * gv));
    block.weight[lane] += sum.weight;
    block.max_weight[lane] = fmaxf(block.max_weight[lane], sum.max_weight);
    block.visible[lane] += 1.0f;
  }

  PHOTOSLAM_DEVICE void optimize(Block& block, uint32_t lane, const Gradient& gradient) const {
    const UpdateConstants& c = constants;
    const float updates = block.updates[lane] + 1.0f;
    block.updates[lane] = updates;
    const float scale1 = c.bias_correction ? 1.0f / scalar::one_minus_exp(updates * c.log_beta1) : 1.0f;
    const float scale2 = c.bias_correction ? 1.0f / scalar::one_minus_exp(updates * c.log_beta2) : 1.0f;
    for_each_row(gradient, [&](int r, float value) {
      if (c.rates[r] == 0) return;
      float first = block.first_moments[r][lane], second = block.second_moments[r][lane];
      block.parameters[r][lane] -=
          scalar::adam_step(value, c.beta1, c.beta2, c.epsilon2, scale1, scale2, c.rates[r], first, second);
      block.first_moments[r][lane] = first;
      block.second_moments[r][lane] = second;
    });
  }
};

}  // namespace photoslam::splatting::cuda
