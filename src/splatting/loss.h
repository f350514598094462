// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/executor.h"
#include "splatting/cpu/buffer.h"
#include "splatting/target_image.h"

namespace photoslam::splatting {

/// Brightness model of one view: what the camera would have seen is gain * render + bias, per channel.
struct Exposure {
  float gain[3] = {1, 1, 1};
  float bias[3] = {0, 0, 0};
};

struct PhotometricLoss {
  float loss = 0;                   ///< (1 − λ) l1 + λ (1 − ssim): paper Eq. (4).
  float l1 = 0;                     ///< Mean absolute difference over channels and pixels with data.
  float ssim = 0;                   ///< Mean over channels and pixels with data; 0 when λ = 0 (not computed).
  float mse = 0;                    ///< Mean squared difference, the render clamped to [0, 1].
  float exposure_gradient[6] = {};  ///< dL/d(gain rgb, bias rgb).
};

/// Sums over the pixels of one channel, as the gradient image is made: g = dL/d(compared value), v = that value.
struct LossSums {
  double l1 = 0, ssim = 0, mse = 0;
  double value = 0;  ///< Σ g v
  double bias = 0;   ///< Σ g
};

/// The loss from the sums of the three channels over `num_valid` pixels.
PhotometricLoss summarize(const LossSums (&channels)[3], int num_valid, float ssim_weight, const Exposure& exposure);

/// Photometric loss and its gradient image, fused. SSIM: 11x11 gaussian window of σ 1.5, zero padding, per channel,
/// C1 = 0.01², C2 = 0.03²; pixels without data are zero in both images and do not count. Keeps its buffers.
class LossFunction {
 public:
  /// `rgb` is [3, H, W] of the target's size; writes dL/drgb of the same shape (the exposure's gain included).
  PhotometricLoss evaluate(std::span<const float> rgb, const TargetImage& target, float ssim_weight,
                           const Exposure& exposure, Executor& executor, std::vector<float>& dl_drgb);

 private:
  Buffer<float> scratch_;  // one slice per worker
};

/// Depth loss: mean over pixels with depth d of |D − A d|, D = Σ w z and A = Σ w as rendered (= |Σ w (z − d)|).
/// Adds nothing to the gradients: overwrites dL/ddepth and dL/dalpha [H, W], scaled by `weight`. Returns the mean.
float depth_loss(std::span<const float> depth, std::span<const float> alpha, const TargetImage& target, float weight,
                 std::vector<float>& dl_ddepth, std::vector<float>& dl_dalpha);

}  // namespace photoslam::splatting
