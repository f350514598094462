// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "base/executor.h"
#include "splatting/model.h"
#include "splatting/view.h"

namespace photoslam::splatting {

/// A rendered view. Planes are row-major; with w the blending weights of paper Eq. (3):
struct RenderResult {
  int width = 0, height = 0;
  std::vector<float> rgb;    ///< Σ w colour + T background  [3, H, W]; not clamped above 1.
  std::vector<float> depth;  ///< Σ w z  [H, W]; divide by alpha for the expected depth [m].
  std::vector<float> alpha;  ///< Σ w = 1 − T  [H, W]
  int visible = 0;           ///< Gaussians that touch at least one tile.
};

/// Makes room for an image of the camera's size.
void resize(RenderResult& result, const Camera& camera);

/// Wall time of the stages of one call [ms].
struct StageTimes {
  double project = 0;   ///< Culling, projection, colours.
  double sort = 0;      ///< Into tiles.
  double forward = 0;   ///< Sorting of each tile by depth, blending.
  double loss = 0;      ///< Loss and its gradient image.
  double backward = 0;  ///< Blending, backwards.
  double update = 0;    ///< Sums per gaussian, projection backwards, optimiser.
  double total() const { return project + sort + forward + loss + backward + update; }
};

class Gpu;

/// Draws gaussians. Keeps its buffers between calls; the image is the same at any concurrency.
class Renderer {
 public:
  /// On a GPU, as long as that works, or (null) on the CPU.
  explicit Renderer(std::shared_ptr<Gpu> gpu = nullptr);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// view.camera_from_anchor must hold one pose per anchor of the model.
  void render(const GaussianModel& model, const View& view, const RenderOptions& options, Executor& executor,
              RenderResult& result);

  /// Times of the last call.
  const StageTimes& times() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace photoslam::splatting
