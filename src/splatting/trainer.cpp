// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/trainer.h"

#include <algorithm>
#include <stdexcept>

#include "base/check.h"
#include "base/clock.h"
#include "splatting/cpu/forward.h"
#include "splatting/cpu/rasterize.h"
#include "splatting/cpu/update.h"
#include "splatting/gpu.h"

namespace photoslam::splatting {

struct Trainer::State {
  std::shared_ptr<Gpu> gpu;
  bool gpu_drew = false;      // the image drawn last …
  bool image_unread = false;  // … which is fetched when somebody asks for it
  Frame frame;
  RenderResult rendered;
  LossFunction loss;
  std::vector<float> dl_drgb, dl_ddepth, dl_dalpha;
};

Trainer::Trainer(std::shared_ptr<Gpu> gpu) : state_(std::make_unique<State>()) { state_->gpu = std::move(gpu); }
Trainer::~Trainer() = default;
Trainer::Trainer(Trainer&&) noexcept = default;
Trainer& Trainer::operator=(Trainer&&) noexcept = default;

StepResult Trainer::step(GaussianModel& model, const View& view, const TargetImage& target, const TrainOptions& options,
                         Executor& executor) {
  const int factor = options.render.shrink_factor;
  PHOTOSLAM_CHECK(
      factor >= 1 && target.width() / factor == view.camera.width && target.height() / factor == view.camera.height,
      "target {}x{}, shrunk by {}, camera {}x{}", target.width(), target.height(), factor, view.camera.width,
      view.camera.height);
  State& s = *state_;
  s.gpu_drew = s.image_unread = false;
  if (s.gpu) {
    if (const auto done = s.gpu->step(model, view, target, options)) {
      resize(s.rendered, view.camera);
      s.gpu_drew = s.image_unread = true;
      return *done;
    }
  }
  model.bring_home();  // wherever another trainer has left it
  StepResult result;
  render_forward(model, view, options.render, executor, s.frame, s.rendered, result.times);
  result.visible = s.rendered.visible;

  Stopwatch watch;
  const TargetImage& compared = target.shrunk(factor, options.depth_weight > 0);
  const PhotometricLoss photometric =
      s.loss.evaluate(s.rendered.rgb, compared, options.ssim_weight, options.exposure, executor, s.dl_drgb);
  result.l1 = photometric.l1;
  result.ssim = photometric.ssim;
  result.mse = photometric.mse;
  std::copy_n(photometric.exposure_gradient, 6, result.exposure_gradient);
  ImageGradient gradient{s.dl_drgb, {}, {}};
  if (options.depth_weight > 0 && compared.num_depth() > 0) {
    result.depth =
        depth_loss(s.rendered.depth, s.rendered.alpha, compared, options.depth_weight, s.dl_ddepth, s.dl_dalpha);
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
  State& s = *state_;
  s.gpu_drew = s.image_unread = false;
  if (s.gpu && s.gpu->forward(model, view, options, true, times, s.rendered.visible)) {
    resize(s.rendered, view.camera);
    s.gpu_drew = s.image_unread = true;
    return;
  }
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
  if (s.gpu_drew) {
    if (!s.gpu->backward(model, dl_drgb, dl_ddepth, dl_dalpha, gradients))
      throw std::runtime_error("the GPU failed between forward and backward: " + s.gpu->failure());
    return;
  }
  rasterize_backward(executor, s.frame, s.rendered, {dl_drgb, dl_ddepth, dl_dalpha});
  dense_gradients(executor, s.frame, model, gradients);
}

const RenderResult& Trainer::rendered() const {
  State& s = *state_;
  if (s.image_unread && !s.gpu->read_image(s.rendered))
    throw std::runtime_error("the GPU failed before its image was read: " + s.gpu->failure());
  s.image_unread = false;
  return s.rendered;
}

}  // namespace photoslam::splatting
