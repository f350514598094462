// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/cpu/update.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "splatting/cpu/targets.h"
#include "splatting/update_constants.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splatting/cpu/update.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "splatting/cpu/colors-inl.h"
#include "splatting/cpu/lanes-inl.h"
#include "splatting/formulas.h"

#ifndef PHOTOSLAM_SPLATTING_UPDATE_ONCE
#define PHOTOSLAM_SPLATTING_UPDATE_ONCE
namespace photoslam::splatting {

/// What the kernel does with the gradients of a block: writes them to `dense`, or lets Adam use them on `model`, or
/// (both null) only sums up the pose.
struct UpdateTarget {
  Block* model = nullptr;
  float* dense = nullptr;  // [row::kCount, 64]
};

}  // namespace photoslam::splatting
#endif

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {

inline constexpr int kRecordSize = sizeof(SplatGradient) / sizeof(float);
enum RecordRow { kT, kDy, kTT, kTDy, kDyDy, kOne, kRed, kDepth = kRed + 3, kWeight, kMaxWeight, kRecordRows };

/// Adds up the records of every visible lane, in order, into rows [kRecordRows, 64].
void gather_records(const Frame& frame, size_t rank, float (*rows)[kBlockSize]) {
  for (uint64_t rest = frame.visible[rank]; rest != 0; rest &= rest - 1) {
    const size_t lane = hwy::Num0BitsBelowLS1Bit_Nonzero64(rest);
    const InstanceRange range = frame.instances[rank * kBlockSize + lane];
    alignas(64) float sums[kRecordSize];
    const float* record = &frame.gradients[frame.first_instance(rank * kBlockSize + lane)].t;
    __builtin_prefetch(record + kRecordSize * 16);
    for (size_t i = 0; i < kRecordSize; i += kLanes) {
      Vec sum = hn::Load(kFloats, record + i);
      for (uint32_t k = 1; k < range.count; ++k) sum = hn::Add(sum, hn::Load(kFloats, record + k * kRecordSize + i));
      hn::Store(sum, kFloats, sums + i);
    }
    float max_weight = sums[kMaxWeight];
    if (range.count > 1) {
      max_weight = 0;
      for (uint32_t k = 0; k < range.count; ++k)
        max_weight = std::max(max_weight, record[k * kRecordSize + kMaxWeight]);
    }
    for (int i = 0; i < kRecordRows; ++i) rows[i][lane] = sums[i];
    rows[kMaxWeight][lane] = max_weight;
  }
}

/// Gradients of a block before anybody uses them. Those of the colour coefficients are products: basis ⊗ colour.
struct BlockGradients {
  alignas(64) float geometry[row::kSh][kBlockSize];
  alignas(64) ShBasis basis;
  alignas(64) float color[3][kBlockSize];
  Mask masks[kParts];  ///< Lanes to use; a part without any holds nothing else.

  HWY_INLINE BlockGradients() {
    for (Mask& mask : masks) mask = hn::FirstN(kFloats, 0);
  }
  HWY_INLINE Lanes at(int r, size_t lane) const {
    if (r < row::kSh) return load(geometry[r] + lane);
    const int k = (r - row::kSh) / 3, c = (r - row::kSh) % 3;
    return load(basis[k] + lane) * load(color[c] + lane);
  }
  /// Bit i: part i has lanes to use.
  HWY_INLINE uint32_t parts() const {
    uint32_t bits = 0;
    for (size_t i = 0; i < kParts; ++i) bits |= static_cast<uint32_t>(!hn::AllFalse(kFloats, masks[i])) << i;
    return bits;
  }
};

/// Colour coefficients: notes the factors of their gradients; returns dL/d(offset) by the viewing direction.
HWY_INLINE void colors_backward(const Block& block, const Projection<Lanes>& g, int degree, const Lanes* color_gradient,
                                size_t lane, BlockGradients& out, Lanes* offset_gradient) {
  Lanes direction[3], weights[kNumShCoefficients], gradient[3];
  const Lanes inverse = normalize(g.offset, direction);
  for (int c = 0; c < 3; ++c) {
    const Lanes rgb = load(out.color[c] + lane);
    gradient[c] = select(rgb > Lanes(0.0f), color_gradient[c], Lanes(0.0f));
    store(gradient[c], out.color[c] + lane);
  }
  for (int k = 0; k < num_sh_coefficients(degree); ++k) {
    Lanes sh[3];
    for (int c = 0; c < 3; ++c) sh[c] = load(block.parameters[row::kSh + 3 * k + c] + lane);
    weights[k] = dot3(sh, gradient);
  }
  Lanes direction_gradient[3];
  sh_basis_backward(degree, direction, weights, direction_gradient);
  normalize_backward(direction, inverse, direction_gradient, offset_gradient);
}

/// Basis functions and colours (before their clamp) of the vectors in `parts`.
HWY_INLINE void block_basis_and_colors(const Block& block, const Block* next, const AnchorView& view, int degree,
                                       uint32_t parts, BlockGradients& out) {
  for (size_t i = 0; i < kParts; ++i) {
    if (((parts >> i) & 1) == 0) continue;
    Lanes offset[3], direction[3], basis[kNumShCoefficients];
    for (int k = 0; k < 3; ++k)
      offset[k] =
          (load(block.parameters[row::kMean + k] + i * kLanes) - Lanes(view.center[k])) - Lanes(view.center_low[k]);
    normalize(offset, direction);
    sh_basis(degree, direction, basis);
    for (int k = 0; k < num_sh_coefficients(degree); ++k) store(basis[k], out.basis[k] + i * kLanes);
  }
  block_colors(block, next, out.basis, degree, parts, out.color);
}

/// One Adam step of the lanes in the masks. Rows stream through once, those to come are fetched ahead.
void adam_block(const BlockGradients& gradients, const UpdateConstants& constants, int degree, Block& block) {
  alignas(64) float scale1[kBlockSize], scale2[kBlockSize];  // bias corrections 1 / (1 − β^n)
  const uint32_t parts = gradients.parts();
  for (size_t i = 0; i < kParts; ++i) {
    if (((parts >> i) & 1) == 0) continue;
    const size_t lane = i * kLanes;
    const LaneMask mask{gradients.masks[i]};
    const Lanes before = load(block.updates + lane), updates = before + Lanes(1.0f);
    store(select(mask, updates, before), block.updates + lane);
    store(constants.bias_correction ? Lanes(1.0f) / one_minus_exp(updates * Lanes(constants.log_beta1)) : Lanes(1.0f),
          scale1 + lane);
    store(constants.bias_correction ? Lanes(1.0f) / one_minus_exp(updates * Lanes(constants.log_beta2)) : Lanes(1.0f),
          scale2 + lane);
  }
  const Lanes beta1(constants.beta1), beta2(constants.beta2), epsilon2(constants.epsilon2);
  constexpr int kAhead = 4;
  const int rows = row::kSh + 3 * num_sh_coefficients(degree);
  for (int r = 0; r < rows; ++r) {
    if (constants.rates[r] == 0) continue;
    const Lanes rate(constants.rates[r]);
    const int next = std::min(r + kAhead, row::kCount - 1);
    for (size_t i = 0; i < kParts; ++i) {
      if (((parts >> i) & 1) == 0) continue;
      const size_t lane = i * kLanes;
      __builtin_prefetch(block.first_moments[next] + lane, 1);
      __builtin_prefetch(block.second_moments[next] + lane, 1);
      const LaneMask mask{gradients.masks[i]};
      float* parameter = block.parameters[r] + lane;
      float* first = block.first_moments[r] + lane;
      float* second = block.second_moments[r] + lane;
      const Lanes gradient = gradients.at(r, lane);
      const Lanes m0 = load(first), v0 = load(second), p0 = load(parameter);
      Lanes m = m0, v = v0;
      const Lanes step =
          adam_step(gradient, beta1, beta2, epsilon2, load(scale1 + lane), load(scale2 + lane), rate, m, v);
      store(select(mask, m, m0), first);
      store(select(mask, v, v0), second);
      store(select(mask, p0 - step, p0), parameter);
    }
  }
}

void write_dense(const BlockGradients& gradients, int degree, float* dense) {
  const uint32_t parts = gradients.parts();
  const int rows = row::kSh + 3 * num_sh_coefficients(degree);
  for (int r = 0; r < rows; ++r)
    for (size_t i = 0; i < kParts; ++i)
      if (((parts >> i) & 1) != 0)
        hn::StoreU(select(LaneMask{gradients.masks[i]}, gradients.at(r, i * kLanes), Lanes(0.0f)).v, kFloats,
                   dense + static_cast<size_t>(r) * kBlockSize + i * kLanes);
}

HWY_INLINE PixelSums<Lanes> pixel_sums(const float (*rows)[kBlockSize], size_t lane) {
  const auto record = [&](int i) { return load(rows[i] + lane); };
  return {record(kOne), record(kT), record(kDy), record(kTT), record(kTDy), record(kDyDy), record(kDepth)};
}

HWY_INLINE void update_statistics(Block& block, size_t lane, LaneMask mask, Lanes half_width, Lanes half_height,
                                  const ScreenGradient<Lanes>& s, const float (*rows)[kBlockSize]) {
  const Lanes gu = s.u * half_width, gv = s.v * half_height;
  const Lanes zero(0.0f);
  const auto accumulate = [&](float* sum, Lanes value) {
    store(load(sum + lane) + select(mask, value, zero), sum + lane);
  };
  accumulate(block.gradient, square_root(mul_add(gu, gu, gv * gv)));
  accumulate(block.weight, load(rows[kWeight] + lane));
  accumulate(block.visible, Lanes(1.0f));
  const Lanes largest = load(block.max_weight + lane);
  store(select(mask, maximum(largest, load(rows[kMaxWeight] + lane)), largest), block.max_weight + lane);
}

/// The way back for one visible block. Adds to the pose gradient. `next` (or null) is fetched ahead.
void backward_block(const Frame& frame, size_t rank, const Block& block, const Block* next,
                    const UpdateConstants& constants, UpdateTarget target, double* pose) {
  alignas(64) float rows[kRecordRows][kBlockSize] = {};
  gather_records(frame, rank, rows);
  const AnchorView& view = frame.anchors[static_cast<size_t>(block.anchor)];
  const Lanes half_width(0.5f * static_cast<float>(frame.width)), half_height(0.5f * static_cast<float>(frame.height));
  Lanes pose_sums[6];
  for (Lanes& sum : pose_sums) sum = Lanes(0.0f);
  BlockGradients gradients;
  for (size_t i = 0; i < kParts; ++i) {
    const uint64_t bits = frame.visible[rank] >> (i * kLanes);
    const uint8_t bytes[8] = {static_cast<uint8_t>(bits), static_cast<uint8_t>(bits >> 8)};
    gradients.masks[i] = hn::LoadMaskBits(kFloats, bytes);
  }
  const uint32_t parts = gradients.parts();
  block_basis_and_colors(block, next, view, frame.sh_degree, parts, gradients);
  for (size_t i = 0; i < kParts; ++i) {
    if (((parts >> i) & 1) == 0) continue;
    const size_t lane = i * kLanes;
    LaneMask mask{gradients.masks[i]};

    Lanes mean[3], rotation[4], log_scale[3];
    for (int k = 0; k < 3; ++k) mean[k] = load(block.parameters[row::kMean + k] + lane);
    for (int k = 0; k < 4; ++k) rotation[k] = load(block.parameters[row::kRotation + k] + lane);
    for (int k = 0; k < 3; ++k) log_scale[k] = load(block.parameters[row::kLogScale + k] + lane);
    Projection<Lanes> g;
    project(view, mean, rotation, log_scale, g);
    const ScreenGradient<Lanes> s = screen_gradient(view, g, pixel_sums(rows, lane));
    const Lanes color[3] = {load(rows[kRed] + lane), load(rows[kRed + 1] + lane), load(rows[kRed + 2] + lane)};
    const Lanes size = absolute(s.u) + absolute(s.v) + absolute(s.exx) + absolute(s.eyy) + absolute(s.exy) +
                       absolute(s.z) + absolute(color[0]) + absolute(color[1]) + absolute(color[2]);
    mask = mask & (size < Lanes(1e18f));  // not a number, or absurd: leave the gaussian alone

    gradients.masks[i] = mask.m;
    if (target.model != nullptr) update_statistics(*target.model, lane, mask, half_width, half_height, s, rows);
    Lanes offset_gradient[3];
    colors_backward(block, g, frame.sh_degree, color, lane, gradients, offset_gradient);
    GeometryGradient<Lanes> out;
    project_backward(view, g, s, offset_gradient, out);
    for (int k = 0; k < 3; ++k) store(out.mean[k], gradients.geometry[row::kMean + k] + lane);
    for (int k = 0; k < 4; ++k) store(out.rotation[k], gradients.geometry[row::kRotation + k] + lane);
    for (int k = 0; k < 3; ++k) store(out.log_scale[k], gradients.geometry[row::kLogScale + k] + lane);
    const Lanes logit = load(block.parameters[row::kOpacity] + lane);
    const Lanes opacity = Lanes(1.0f) / (Lanes(1.0f) + exponential(minimum(-logit, Lanes(80.0f))));
    const Lanes d_log_opacity = mul_add(opacity, Lanes(constants.opacity_weight), load(rows[kOne] + lane));
    store((Lanes(1.0f) - opacity) * d_log_opacity, gradients.geometry[row::kOpacity] + lane);
    for (int k = 0; k < 6; ++k) pose_sums[k] = pose_sums[k] + select(mask, out.pose[k], Lanes(0.0f));
  }
  if (target.model != nullptr) adam_block(gradients, constants, frame.sh_degree, *target.model);
  if (target.dense != nullptr) write_dense(gradients, frame.sh_degree, target.dense);
  for (int i = 0; i < 6; ++i) pose[i] += static_cast<double>(hn::GetLane(hn::SumOfLanes(kFloats, pose_sums[i].v)));
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam::splatting {
namespace {

HWY_EXPORT(backward_block);

/// Runs the kernel over all visible blocks, and finish(block) after each; the pose is summed per task and then in the
/// order of the tasks.
template <class TargetOf, class Finish>
void run_backward(Executor& executor, Frame& frame, const GaussianModel& model, const UpdateConstants& constants,
                  TargetOf&& target_of, Finish&& finish, float pose[6]) {
  std::vector<double> sums(static_cast<size_t>(frame.num_tasks()) * 6, 0.0);
  executor.for_each(frame.num_tasks(), [&](int task, int) {
    const int end = std::min((task + 1) * kBlocksPerTask, frame.num_ranks());
    for (int rank = task * kBlocksPerTask; rank < end; ++rank) {
      const size_t r = static_cast<size_t>(rank), b = frame.blocks[r];
      if (frame.visible[r] == 0) continue;
      const Block* next = rank + 1 < frame.num_ranks() ? &model.block(frame.blocks[r + 1]) : nullptr;
      HWY_DYNAMIC_DISPATCH(backward_block)
      (frame, r, model.block(b), next, constants, target_of(b), &sums[static_cast<size_t>(task) * 6]);
      finish(b);
    }
  });
  double total[6] = {};
  for (size_t i = 0; i < sums.size(); ++i) total[i % 6] += sums[i];
  for (int i = 0; i < 6; ++i) pose[i] = static_cast<float>(total[i]);
}

}  // namespace

void update_model(Executor& executor, Frame& frame, const TrainOptions& options, GaussianModel& model, float pose[6]) {
  UpdateConstants constants = make_update_constants(options);
  constants.opacity_weight /= static_cast<float>(std::max(frame.num_visible, 1));
  run_backward(
      executor, frame, model, constants,
      [&](size_t b) { return UpdateTarget{options.update ? &model.block(b) : nullptr, nullptr}; },
      [&](size_t b) {
        if (options.update) model.update_bounds(b);
      },
      pose);
}

void dense_gradients(Executor& executor, Frame& frame, const GaussianModel& model, Gradients& gradients) {
  constexpr size_t kBlockValues = static_cast<size_t>(row::kCount) * kBlockSize;
  gradients.values.assign(model.num_blocks() * kBlockValues, 0.0f);
  run_backward(
      executor, frame, model, UpdateConstants{},
      [&](size_t b) { return UpdateTarget{nullptr, gradients.values.data() + b * kBlockValues}; }, [](size_t) {},
      gradients.pose);
}

}  // namespace photoslam::splatting
#endif  // HWY_ONCE
