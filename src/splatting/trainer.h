// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/executor.h"
#include "splatting/loss.h"
#include "splatting/model.h"
#include "splatting/renderer.h"
#include "splatting/target_image.h"
#include "splatting/view.h"

namespace photoslam::splatting {

/// Adam step sizes; 0 freezes the group.
struct LearningRates {
  float mean = 1.6e-4f;  ///< [m]
  float rotation = 1e-3f;
  float log_scale = 5e-3f;
  float opacity = 0.05f;
  float sh_dc = 2.5e-3f;
  float sh_rest = 1.25e-4f;
};

struct TrainOptions {
  RenderOptions render;
  LearningRates rates;
  float beta1 = 0.9f, beta2 = 0.999f;
  float epsilon = 1e-15f;       ///< The denominator is sqrt(v + ε²).
  bool bias_correction = true;  ///< By each gaussian's own number of updates.
  float ssim_weight = 0.2f;     ///< λ of paper Eq. (4); 0 skips SSIM and is much cheaper.
  float depth_weight = 0;       ///< Weight of the depth loss; ignored when the target has no depth.
  float opacity_weight = 0;     ///< Weight of the mean opacity of the visible gaussians.
  Exposure exposure;            ///< Applied to the render before the photometric loss.
  bool update = true;           ///< false: gaussians, optimiser state and statistics stay as they are.
};

struct StepResult {
  float loss = 0;  ///< Photometric + depth_weight * depth (regularisers not included).
  float l1 = 0, ssim = 0, mse = 0;
  float depth = 0;  ///< Mean |D − A d| [m]; 0 without depth.
  int visible = 0;
  /// dL/dξ for camera_from_anchor ← exp(ξ) camera_from_anchor (all anchors alike): left twist in the camera frame,
  /// translation first. Includes covariances and the viewing direction of the spherical harmonics.
  float pose_gradient[6] = {};
  float exposure_gradient[6] = {};  ///< dL/d(gain rgb, bias rgb).
  StageTimes times;                 ///< [ms]
};

/// Dense gradients, in the layout of the model's blocks.
struct Gradients {
  std::vector<float> values;  // [blocks, row::kCount, 64]
  float pose[6] = {};         ///< As StepResult::pose_gradient.
  float at(size_t index, int parameter_row) const {
    return values[((index / kBlockSize) * row::kCount + static_cast<size_t>(parameter_row)) * kBlockSize +
                  index % kBlockSize];
  }
};

class Gpu;

/// Fits gaussians to images: projects, sorts, blends, compares, goes back and updates what was visible.
/// Keeps its buffers between calls. Results are the same at any concurrency.
class Trainer {
 public:
  /// On a GPU, as long as that works, or (null) on the CPU.
  explicit Trainer(std::shared_ptr<Gpu> gpu = nullptr);
  ~Trainer();
  Trainer(Trainer&&) noexcept;
  Trainer& operator=(Trainer&&) noexcept;

  /// One optimisation step on one view; the target, shrunk as the render is, has the size of the camera.
  StepResult step(GaussianModel& model, const View& view, const TargetImage& target, const TrainOptions& options,
                  Executor& executor);

  /// Renders (see rendered()) without touching the model; a call of backward() may follow.
  void forward(const GaussianModel& model, const View& view, const RenderOptions& options, Executor& executor);

  /// Gradients of a scalar L given dL/drgb [3, H, W], dL/ddepth and dL/dalpha [H, W] (empty = zero), for the view
  /// of the preceding forward() and its model, which must not have changed.
  void backward(const GaussianModel& model, std::span<const float> dl_drgb, std::span<const float> dl_ddepth,
                std::span<const float> dl_dalpha, Executor& executor, Gradients& gradients);

  /// The image of the last step() or forward(), as rendered before the update and before any exposure.
  const RenderResult& rendered() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace photoslam::splatting
