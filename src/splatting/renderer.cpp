// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/renderer.h"

#include "base/clock.h"
#include "splatting/cpu/forward.h"
#include "splatting/gpu.h"

namespace photoslam::splatting {

struct Renderer::State {
  std::shared_ptr<Gpu> gpu;
  Frame frame;
  StageTimes times;
};

Renderer::Renderer(std::shared_ptr<Gpu> gpu) : state_(std::make_unique<State>()) { state_->gpu = std::move(gpu); }
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

void Renderer::render(const GaussianModel& model, const View& view, const RenderOptions& options, Executor& executor,
                      RenderResult& result) {
  state_->times = {};
  if (state_->gpu && state_->gpu->forward(model, view, options, false, state_->times, result.visible)) {
    resize(result, view.camera);
    if (state_->gpu->read_image(result)) return;
  }
  render_forward(model, view, options, executor, state_->frame, result, state_->times);
}

void resize(RenderResult& result, const Camera& camera) {
  const size_t plane = static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
  result.width = camera.width;
  result.height = camera.height;
  result.rgb.resize(3 * plane);
  result.depth.resize(plane);
  result.alpha.resize(plane);
}

const StageTimes& Renderer::times() const { return state_->times; }

}  // namespace photoslam::splatting
