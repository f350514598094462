// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/gpu.h"

#include <algorithm>
#include <array>

#include "base/check.h"
#include "base/module.h"

namespace photoslam::splatting {
namespace {

Result<const cuda::Module*> load_module() {
  const auto entry = find_in_module("photoslam_cuda.so", "photoslam_cuda_module");
  if (!entry) return error("no GPU backend: {}", entry.error().message);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): what a module exports is a function
  const cuda::Module* const module = reinterpret_cast<cuda::ModuleEntry>(*entry)();
  if (module->version != cuda::kModuleVersion) return error("no GPU backend: photoslam_cuda.so is of another version");
  return module;
}

using Text = std::array<char, 512>;

}  // namespace

/// What the model's residence and the target images may outlive.
struct Gpu::State {
  std::unique_ptr<cuda::DeviceEngine> engine;
  std::string failure;
  std::weak_ptr<RemoteModel> resident;
  std::vector<AnchorView> anchors;
  uint64_t next_target = 1;
  double busy_ms = 0;

  void fail(const std::string& what) {
    if (failure.empty()) failure = what;
  }
  /// Does something on the GPU; false if that has failed, now or before.
  template <class Work>
  bool attempt(Work&& work) {
    if (!failure.empty()) return false;
    try {
      work();
      return true;
    } catch (const cuda::DeviceError& e) {
      fail(e.what());
      return false;
    }
  }
  void exchange(const GaussianModel& model) const;
};

/// Makes the model there like the model here.
void Gpu::State::exchange(const GaussianModel& model) const {
  const auto changes = model.changes();
  if (!changes) return;
  cuda::Arrangement arrangement;
  arrangement.num_blocks = static_cast<uint32_t>(model.num_blocks());
  arrangement.sources = changes->sources.data();
  arrangement.anchors = changes->anchors.data();
  arrangement.counts = changes->counts.data();
  arrangement.records = changes->records.data();
  arrangement.num_records = static_cast<uint32_t>(changes->records.size() / row::kTableRows);
  arrangement.moves = changes->moves;
  arrangement.clear_statistics = changes->clear_statistics;
  engine->arrange(arrangement);
  model.exchanged();
}

/// The model on the GPU, as the model on the host sees it.
class Gpu::Residence final : public RemoteModel {
 public:
  explicit Residence(std::shared_ptr<State> state) : state_(std::move(state)) {}
  bool fetch(int first_row, int num_rows, float* rows) override {
    try {
      state_->engine->fetch(first_row, num_rows, rows);
      return true;
    } catch (const cuda::DeviceError& e) {
      state_->fail(e.what());
      return false;
    }
  }
  bool judge(const GaussianModel& model, const DensityRules& rules, std::span<Fate> fates) override {
    return state_->attempt([&] {
      state_->exchange(model);
      state_->engine->judge(rules, fates.data());
    });
  }
  std::optional<size_t> breed(const GaussianModel& model, std::span<const Child> children) override {
    const bool done = state_->attempt([&] {
      state_->exchange(model);
      state_->engine->breed(children.data(), static_cast<uint32_t>(children.size()));
    });
    return done ? std::optional(model.index_end()) : std::nullopt;
  }
  const State* state() const { return state_.get(); }

 private:
  std::shared_ptr<State> state_;
};

namespace {

/// A target image's place on the GPU.
template <class State>
struct TargetHandle {
  std::weak_ptr<State> gpu;
  uint64_t id;
  TargetHandle(const std::shared_ptr<State>& state, uint64_t number) : gpu(state), id(number) {}
  ~TargetHandle() {
    if (const auto state = gpu.lock()) state->engine->forget_target(id);
  }
  TargetHandle(const TargetHandle&) = delete;
  TargetHandle& operator=(const TargetHandle&) = delete;
};

template <class State>
cuda::DeviceTarget device_target(const std::shared_ptr<State>& state, const TargetImage& target, int factor) {
  using Handle = TargetHandle<State>;
  auto handle = std::static_pointer_cast<Handle>(target.remote());
  if (handle == nullptr || handle->gpu.lock() != state) {
    handle = std::make_shared<Handle>(state, state->next_target++);
    target.set_remote(handle);
  }
  cuda::DeviceTarget device;
  device.id = handle->id;
  device.width = target.width();
  device.height = target.height();
  device.factor = factor;
  device.rgb = target.planes().data();
  device.mask = target.has_mask() ? target.mask().data() : nullptr;
  device.depth = target.has_depth() ? target.depth().data() : nullptr;
  device.depth_unit = target.depth_unit();
  device.num_valid = target.num_valid();
  device.num_depth = target.num_depth();
  return device;
}

StageTimes stage_times(const cuda::Figures& figures) {
  const float* t = figures.times;
  const auto at = [t](int i) { return static_cast<double>(t[i]); };
  return {at(0), at(1), at(2), at(3), at(4), at(5)};
}

StepResult step_result(const cuda::Figures& figures, const TrainOptions& options) {
  StepResult result;
  LossSums sums[3];
  for (int c = 0; c < 3; ++c) {
    const cuda::ChannelSums& channel = figures.channels[c];
    sums[c] = {channel.l1, options.ssim_weight > 0 ? channel.ssim : 0, channel.mse, channel.value, channel.bias};
  }
  const PhotometricLoss photometric = summarize(sums, figures.num_valid, options.ssim_weight, options.exposure);
  result.l1 = photometric.l1;
  result.ssim = photometric.ssim;
  result.mse = photometric.mse;
  std::copy_n(photometric.exposure_gradient, 6, result.exposure_gradient);
  if (options.depth_weight > 0 && figures.num_depth > 0)
    result.depth = static_cast<float>(figures.depth / figures.num_depth);
  result.loss = photometric.loss + options.depth_weight * result.depth;
  result.visible = static_cast<int>(figures.visible);
  std::transform(figures.pose, figures.pose + 6, result.pose_gradient, [](double v) { return static_cast<float>(v); });
  result.times = stage_times(figures);
  return result;
}

}  // namespace

Result<std::shared_ptr<Gpu>> Gpu::open(double memory_mb) {
  const auto module = load_module();
  if (!module) return module.error();
  Text text{};
  std::unique_ptr<cuda::DeviceEngine> engine(
      (*module)->open(static_cast<uint64_t>(1e6 * memory_mb), text.data(), static_cast<int>(text.size())));
  if (engine == nullptr) return error("{}", text.data());
  return std::make_shared<Gpu>(std::move(engine), text.data());
}

Gpu::Gpu(std::unique_ptr<cuda::DeviceEngine> engine, std::string name)
    : name_(std::move(name)), state_(std::make_shared<State>()) {
  state_->engine = std::move(engine);
}

Gpu::~Gpu() = default;

double Gpu::peak_mb() const { return 1e-6 * static_cast<double>(state_->engine->peak_bytes()); }

double Gpu::busy_seconds() const { return 1e-3 * state_->busy_ms; }

const std::string& Gpu::failure() const { return state_->failure; }

/// Does something with the model there; false if that has failed, now or before.
template <class Work>
bool Gpu::attempt(const GaussianModel& model, Work&& work) {
  if (state_->attempt(std::forward<Work>(work))) return true;
  model.bring_home();
  return false;
}

/// Moves in what is not there yet, and makes it like the model here.
void Gpu::settle(const GaussianModel& model) {
  const auto* const residence = dynamic_cast<const Residence*>(model.remote());
  if (residence == nullptr || residence->state() != state_.get()) {
    PHOTOSLAM_CHECK(state_->resident.expired(), "the GPU holds another model");
    const auto created = std::make_shared<Residence>(state_);
    model.attach(created);
    state_->resident = created;
  }
  state_->exchange(model);
}

cuda::DeviceView Gpu::device_view(const GaussianModel& model, const View& view, const RenderOptions& options) {
  PHOTOSLAM_CHECK(view.camera_from_anchor.size() >= static_cast<size_t>(model.num_anchors()), "{} poses, {} anchors",
                  view.camera_from_anchor.size(), model.num_anchors());
  PHOTOSLAM_CHECK(view.camera.width >= 1 && view.camera.height >= 1, "{}x{}", view.camera.width, view.camera.height);
  state_->anchors.clear();
  for (const Pose& pose : view.camera_from_anchor)
    state_->anchors.push_back(make_anchor_view(pose, view.camera, options));
  cuda::DeviceView device;
  device.width = view.camera.width;
  device.height = view.camera.height;
  device.sh_degree = std::clamp(std::min(options.sh_degree, model.sh_degree()), 0, kMaxShDegree);
  std::copy_n(options.background, 3, device.background);
  device.anchors = state_->anchors.data();
  device.num_anchors = static_cast<uint32_t>(state_->anchors.size());
  return device;
}

std::optional<StepResult> Gpu::step(GaussianModel& model, const View& view, const TargetImage& target,
                                    const TrainOptions& options) {
  std::optional<StepResult> result;
  attempt(model, [&] {
    const cuda::DeviceView on_device = device_view(model, view, options.render);
    settle(model);
    cuda::DeviceLoss loss;
    std::copy_n(options.exposure.gain, 3, loss.gain);
    std::copy_n(options.exposure.bias, 3, loss.bias);
    loss.ssim_weight = options.ssim_weight;
    loss.depth_weight = options.depth_weight;
    const cuda::Figures figures =
        state_->engine->step(on_device, device_target(state_, target, options.render.shrink_factor), loss,
                             make_update_constants(options), options.update);
    if (options.update) model.trained_remotely();
    result = step_result(figures, options);
    state_->busy_ms += result->times.total();
  });
  return result;
}

bool Gpu::forward(const GaussianModel& model, const View& view, const RenderOptions& options, bool keep,
                  StageTimes& times, int& visible) {
  return attempt(model, [&] {
    const cuda::DeviceView on_device = device_view(model, view, options);
    settle(model);
    const cuda::Figures figures = state_->engine->forward(on_device, keep);
    times = stage_times(figures);
    state_->busy_ms += times.total();
    visible = static_cast<int>(figures.visible);
  });
}

bool Gpu::backward(const GaussianModel& model, std::span<const float> dl_drgb, std::span<const float> dl_ddepth,
                   std::span<const float> dl_dalpha, Gradients& gradients) {
  return attempt(model, [&] {
    const auto pointer = [](std::span<const float> values) { return values.empty() ? nullptr : values.data(); };
    gradients.values.resize(model.index_end() * static_cast<size_t>(row::kCount));
    const cuda::Figures figures =
        state_->engine->backward(pointer(dl_drgb), pointer(dl_ddepth), pointer(dl_dalpha), gradients.values.data());
    std::transform(figures.pose, figures.pose + 6, gradients.pose, [](double v) { return static_cast<float>(v); });
    state_->busy_ms += stage_times(figures).total();
  });
}

bool Gpu::read_image(RenderResult& result) {
  // Should it fail, the model comes home when it is needed.
  return state_->attempt(
      [&] { state_->engine->read_image({result.rgb.data(), result.depth.data(), result.alpha.data()}); });
}

std::unique_ptr<GpuUndistorter> Gpu::make_undistorter(std::span<const cuda::DeviceLens> lenses) const {
  try {
    return std::make_unique<GpuUndistorter>(
        state_->engine->make_undistorter(lenses.data(), static_cast<int>(lenses.size())));
  } catch (const cuda::DeviceError& e) {
    return std::make_unique<GpuUndistorter>(e.what());
  }
}

Result<std::string> describe_gpu() {
  const auto module = load_module();
  if (!module) return module.error();
  Text text{};
  if (!(*module)->describe(text.data(), static_cast<int>(text.size()))) return error("{}", text.data());
  return std::string(text.data());
}

Backend parse_backend(const std::string& name) {
  PHOTOSLAM_CHECK(name == "auto" || name == "cpu" || name == "cuda", "backend {}", name);
  return name == "auto" ? Backend::automatic : name == "cpu" ? Backend::cpu : Backend::cuda;
}

Result<std::shared_ptr<Gpu>> choose_backend(Backend backend, double memory_mb, std::string& note) {
  if (backend == Backend::cpu) return std::shared_ptr<Gpu>();
  auto gpu = Gpu::open(memory_mb);
  if (gpu || backend == Backend::cuda) return gpu;
  note = gpu.error().message;
  return std::shared_ptr<Gpu>();
}

}  // namespace photoslam::splatting
