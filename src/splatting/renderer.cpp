// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/renderer.h"

#include "base/clock.h"
#include "splatting/cpu/forward.h"

namespace photoslam::splatting {

struct Renderer::State {
  Frame frame;
  StageTimes times;
};

Renderer::Renderer() : state_(std::make_unique<State>()) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

void Renderer::render(const GaussianModel& model, const View& view, const RenderOptions& options, Executor& executor,
                      RenderResult& result) {
  state_->times = {};
  render_forward(model, view, options, executor, state_->frame, result, state_->times);
}

const StageTimes& Renderer::times() const { return state_->times; }

}  // namespace photoslam::splatting
