// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/trainer.h"

#include <algorithm>

#include "base/check.h"
#include "base/clock.h"
#include "splatting/cpu/forward.h"
#include "splatting/cpu/rasterize.h"
#include "splatting/cpu/update.h"

namespace photoslam::splatting {

struct Trainer::State {
  Frame frame;
  RenderResult rendered;
  LossFunction loss;
  std::vector<float> dl_drgb, dl_ddepth, dl_dalpha;
};

Trainer::Trainer() : state_(std::make_unique<State>()) {}
Trainer::~Trainer() = default;
Trainer::Trainer(Trainer&&) noexcept = default;
Trainer& Trainer::operator=(Trainer&&) noexcept = default;

StepResult Trainer::step(GaussianModel& model, const View& view, const TargetImage& target, const TrainOptions& options,
                         Executor& executor) {
  PHOTOSLAM_CHECK(target.width() == view.camera.width && target.height() == view.camera.height,
                  "target {}x{}, camera {}x{}", target.width(), target.height(), view.camera.width, view.camera.height);
  State& s = *state_;
  StepResult result;
  render_forward(model, view, options.render, executor, s.frame, s.rendered, result.times);
  result.visible = s.rendered.visible;

  Stopwatch watch;
  const PhotometricLoss photometric =
      s.loss.evaluate(s.rendered.rgb, target, options.ssim_weight, options.exposure, executor, s.dl_drgb);
  result.l1 = photometric.l1;
  result.ssim = photometric.ssim;
  result.mse = photometric.mse;
  std::copy_n(photometric.exposure_gradient, 6, result.exposure_gradient);
  ImageGradient gradient{s.dl_drgb, {}, {}};
  if (options.depth_weight > 0 && target.num_depth() > 0) {
    result.depth =
        depth_loss(s.rendered.depth, s.rendered.alpha, target, options.depth_weight, s.dl_ddepth, s.dl_dalpha);
    gradient.depth = s.dl_ddepth;
    gradient.alpha = s.dl_dalpha;
  }
  result.loss = photometric.loss + options.depth_weight * result.depth;
  result.times.loss = watch.milliseconds();

  watch.restart();
  rasterize_backward(executor, s.frame, s.rendered, gradient);
  result.times.backward = watch.milliseconds();
  watch.restart();
  update_model(executor, s.frame, options, model, result.pose_gradient);
  result.times.update = watch.milliseconds();
  return result;
}

void Trainer::forward(const GaussianModel& model, const View& view, const RenderOptions& options, Executor& executor) {
  StageTimes times;
  render_forward(model, view, options, executor, state_->frame, state_->rendered, times);
}

void Trainer::backward(const GaussianModel& model, std::span<const float> dl_drgb, std::span<const float> dl_ddepth,
                       std::span<const float> dl_dalpha, Executor& executor, Gradients& gradients) {
  State& s = *state_;
  const size_t plane = s.rendered.alpha.size();
  PHOTOSLAM_CHECK(plane > 0 && dl_drgb.size() == 3 * plane, "{} colour gradients for {} pixels", dl_drgb.size(), plane);
  PHOTOSLAM_CHECK(dl_ddepth.empty() || dl_ddepth.size() == plane, "{} depth gradients, {} pixels", dl_ddepth.size(),
                  plane);
  PHOTOSLAM_CHECK(dl_dalpha.empty() || dl_dalpha.size() == plane, "{} alpha gradients, {} pixels", dl_dalpha.size(),
                  plane);
  rasterize_backward(executor, s.frame, s.rendered, {dl_drgb, dl_ddepth, dl_dalpha});
  dense_gradients(executor, s.frame, model, gradients);
}

const RenderResult& Trainer::rendered() const { return state_->rendered; }

}  // namespace photoslam::splatting
