// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "splatting/cuda/device_engine.h"
#include "splatting/gpu_undistorter.h"
#include "splatting/trainer.h"

namespace photoslam::splatting {

/// A GPU that trains and draws one model at a time. What fails on it (out of memory, the GPU is gone) makes it useless
/// from then on: the model is brought home and whoever asked does the work on the CPU. For one thread at a time.
class Gpu {
 public:
  /// The first GPU there is, with at most so much of its memory. The error says why there is none.
  static Result<std::shared_ptr<Gpu>> open(double memory_mb);
  /// Any engine.
  Gpu(std::unique_ptr<cuda::DeviceEngine> engine, std::string name);
  ~Gpu();
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;

  const std::string& name() const { return name_; }
  /// Most memory in use at any time, the driver's own not included [MB].
  double peak_mb() const;
  /// How long it has drawn and trained in all [s], by its own clock, from the first kernel of each call to the last.
  /// Transfers of models and densification do not count.
  double busy_seconds() const;
  /// Why it is of no more use; empty as long as all goes well.
  const std::string& failure() const;

  // As Trainer's and Renderer's functions; false or nothing: it has failed.
  std::optional<StepResult> step(GaussianModel& model, const View& view, const TargetImage& target,
                                 const TrainOptions& options);
  bool forward(const GaussianModel& model, const View& view, const RenderOptions& options, bool keep, StageTimes& times,
               int& visible);
  bool backward(const GaussianModel& model, std::span<const float> dl_drgb, std::span<const float> dl_ddepth,
                std::span<const float> dl_dalpha, Gradients& gradients);
  /// The image drawn last.
  bool read_image(RenderResult& result);

  /// For the pictures of these lenses; its memory counts as this one's. May be called while another thread trains.
  std::unique_ptr<GpuUndistorter> make_undistorter(std::span<const cuda::DeviceLens> lenses) const;

 private:
  struct State;
  class Residence;

  void settle(const GaussianModel& model);
  cuda::DeviceView device_view(const GaussianModel& model, const View& view, const RenderOptions& options);
  template <class Work>
  bool attempt(const GaussianModel& model, Work&& work);

  std::string name_;
  std::shared_ptr<State> state_;
};

/// The GPU that Gpu::open() would take; the error says why there is none.
Result<std::string> describe_gpu();

enum class Backend { automatic, cpu, cuda };
/// "auto", "cpu" or "cuda".
Backend parse_backend(const std::string& name);

/// What to splat with: null is the CPU. `note` says why `automatic` takes it. An error if `cuda` is asked for in vain.
Result<std::shared_ptr<Gpu>> choose_backend(Backend backend, double memory_mb, std::string& note);

}  // namespace photoslam::splatting
