// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/cpu/update.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "splatting/cpu/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splatting/cpu/update.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
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

struct UpdateConstants {
  float rates[row::kCount] = {};
  float beta1 = 0, beta2 = 0, epsilon2 = 0;
  float log_beta1 = 0, log_beta2 = 0;
  bool bias_correction = false;
  float opacity_gradient = 0;  ///< dL/d(opacity) of the regulariser.
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
    const float* record = &frame.gradients[range.first].t;
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

/// 1 − exp(x) for x <= 0, accurate near zero.
HWY_INLINE Lanes one_minus_exp(Lanes x) {
  Lanes series(1.0f / 40320.0f);
  for (const float c : {1.0f / 5040, 1.0f / 720, 1.0f / 120, 1.0f / 24, 1.0f / 6, 0.5f, 1.0f})
    series = mul_add(series, x, Lanes(c));
  return select(x > Lanes(-0.35f), -(series * x), Lanes(1.0f) - exponential(x));
}

/// Consumes the gradient of one parameter row of one vector of gaussians.
struct Consumer {
  const UpdateConstants& constants;
  UpdateTarget target;
  size_t lane;
  LaneMask mask;
  Lanes scale1, scale2;  ///< Bias corrections 1 / (1 − β^n).

  HWY_INLINE void begin() {
    scale1 = scale2 = Lanes(1.0f);
    if (target.model == nullptr) return;
    const Lanes updates = load(target.model->updates + lane) + Lanes(1.0f);
    if (constants.bias_correction) {
      scale1 = Lanes(1.0f) / one_minus_exp(updates * Lanes(constants.log_beta1));
      scale2 = Lanes(1.0f) / one_minus_exp(updates * Lanes(constants.log_beta2));
    }
    store(select(mask, updates, load(target.model->updates + lane)), target.model->updates + lane);
  }

  HWY_INLINE void consume(int r, Lanes gradient) {
    if (target.dense != nullptr) {
      hn::StoreU(select(mask, gradient, Lanes(0.0f)).v, kFloats, target.dense + r * kBlockSize + lane);
    } else if (target.model != nullptr && constants.rates[r] != 0) {
      adam(r, gradient);
    }
  }

  HWY_INLINE void adam(int r, Lanes gradient) {
    float* parameter = target.model->parameters[r] + lane;
    float* first = target.model->first_moments[r] + lane;
    float* second = target.model->second_moments[r] + lane;
    const Lanes m0 = load(first), v0 = load(second), p0 = load(parameter);
    const Lanes m = mul_add(Lanes(constants.beta1), m0 - gradient, gradient);
    const Lanes square = gradient * gradient;
    const Lanes v = mul_add(Lanes(constants.beta2), v0 - square, square);
    const Lanes denominator = reciprocal_sqrt(mul_add(v, scale2, Lanes(constants.epsilon2)).v);
    const Lanes step = Lanes(constants.rates[r]) * scale1 * m * denominator;
    store(select(mask, m, m0), first);
    store(select(mask, v, v0), second);
    store(select(mask, p0 - step, p0), parameter);
  }
};

/// Colour coefficients: consumes their gradients basis ⊗ dL/d(colour); returns dL/d(offset) by the viewing direction.
HWY_INLINE void colors_backward(const Block& block, const Projection<Lanes>& g, int degree, const Lanes* color_gradient,
                                Consumer& consumer, Lanes* offset_gradient) {
  Lanes direction[3], basis[kNumShCoefficients], weights[kNumShCoefficients];
  const Lanes inverse = normalize(g.offset, direction);
  sh_basis(degree, direction, basis);
  const int coefficients = num_sh_coefficients(degree);
  Lanes rgb[3] = {Lanes(0.5f), Lanes(0.5f), Lanes(0.5f)};
  for (int k = 0; k < coefficients; ++k)
    for (int c = 0; c < 3; ++c)
      rgb[c] = mul_add(basis[k], load(block.parameters[row::kSh + 3 * k + c] + consumer.lane), rgb[c]);
  Lanes gradient[3];
  for (int c = 0; c < 3; ++c) gradient[c] = select(rgb[c] > Lanes(0.0f), color_gradient[c], Lanes(0.0f));
  for (int k = 0; k < coefficients; ++k) {
    Lanes sh[3];
    for (int c = 0; c < 3; ++c) sh[c] = load(block.parameters[row::kSh + 3 * k + c] + consumer.lane);
    weights[k] = dot3(sh, gradient);
    for (int c = 0; c < 3; ++c) consumer.consume(row::kSh + 3 * k + c, basis[k] * gradient[c]);
  }
  Lanes direction_gradient[3];
  sh_basis_backward(degree, direction, weights, direction_gradient);
  normalize_backward(direction, inverse, direction_gradient, offset_gradient);
}

/// From the summed records to what project_backward() takes. With e = covariance⁻¹ (pixel − position):
/// e.x = a1 t, e.y = c1 dy − slope a1 t where a1 = c/det, c1 = 1/c, slope = b/c.
HWY_INLINE ScreenGradient<Lanes> screen_gradient(const Projection<Lanes>& g, const float (*rows)[kBlockSize],
                                                 size_t lane) {
  const auto record = [&](int i) { return load(rows[i] + lane); };
  const Lanes c1 = Lanes(1.0f) / g.c, a1 = g.c / g.det;
  const Lanes along = g.b * c1 * a1;  // slope a1
  ScreenGradient<Lanes> s;
  s.u = a1 * record(kT);
  s.v = c1 * record(kDy) - along * record(kT);
  s.exx = a1 * a1 * record(kTT);
  s.exy = a1 * (c1 * record(kTDy) - along * record(kTT));
  s.eyy = c1 * c1 * record(kDyDy) + along * (along * record(kTT) - (c1 + c1) * record(kTDy));
  s.z = record(kDepth);
  return s;
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

/// The way back for one visible block. Adds to the pose gradient.
void backward_block(const Frame& frame, size_t rank, const Block& block, const UpdateConstants& constants,
                    UpdateTarget target, double* pose) {
  alignas(64) float rows[kRecordRows][kBlockSize] = {};
  gather_records(frame, rank, rows);
  const AnchorView& view = frame.anchors[static_cast<size_t>(block.anchor)];
  const Lanes half_width(0.5f * static_cast<float>(frame.width)), half_height(0.5f * static_cast<float>(frame.height));
  Lanes pose_sums[6] = {};
  for (size_t lane = 0; lane < static_cast<size_t>(block.count); lane += kLanes) {
    const uint64_t bits = frame.visible[rank] >> lane;
    const uint8_t bytes[8] = {static_cast<uint8_t>(bits), static_cast<uint8_t>(bits >> 8)};
    LaneMask mask{hn::LoadMaskBits(kFloats, bytes)};
    if (hn::AllFalse(kFloats, mask.m)) continue;

    Lanes mean[3], rotation[4], log_scale[3];
    for (int i = 0; i < 3; ++i) mean[i] = load(block.parameters[row::kMean + i] + lane);
    for (int i = 0; i < 4; ++i) rotation[i] = load(block.parameters[row::kRotation + i] + lane);
    for (int i = 0; i < 3; ++i) log_scale[i] = load(block.parameters[row::kLogScale + i] + lane);
    Projection<Lanes> g;
    project(view, mean, rotation, log_scale, g);
    const ScreenGradient<Lanes> s = screen_gradient(g, rows, lane);
    const Lanes color[3] = {load(rows[kRed] + lane), load(rows[kRed + 1] + lane), load(rows[kRed + 2] + lane)};
    const Lanes size = absolute(s.u) + absolute(s.v) + absolute(s.exx) + absolute(s.eyy) + absolute(s.exy) +
                       absolute(s.z) + absolute(color[0]) + absolute(color[1]) + absolute(color[2]);
    mask = mask & (size < Lanes(1e18f));  // not a number, or absurd: leave the gaussian alone

    Consumer consumer{constants, target, lane, mask, {}, {}};
    consumer.begin();
    if (target.model != nullptr) update_statistics(*target.model, lane, mask, half_width, half_height, s, rows);
    Lanes offset_gradient[3];
    colors_backward(block, g, frame.sh_degree, color, consumer, offset_gradient);
    GeometryGradient<Lanes> out;
    project_backward(view, g, s, offset_gradient, out);
    for (int i = 0; i < 3; ++i) consumer.consume(row::kMean + i, out.mean[i]);
    for (int i = 0; i < 4; ++i) consumer.consume(row::kRotation + i, out.rotation[i]);
    for (int i = 0; i < 3; ++i) consumer.consume(row::kLogScale + i, out.log_scale[i]);
    const Lanes logit = load(block.parameters[row::kOpacity] + lane);
    const Lanes opacity = Lanes(1.0f) / (Lanes(1.0f) + exponential(minimum(-logit, Lanes(80.0f))));
    const Lanes d_log_opacity = mul_add(opacity, Lanes(constants.opacity_gradient), load(rows[kOne] + lane));
    consumer.consume(row::kOpacity, (Lanes(1.0f) - opacity) * d_log_opacity);
    for (int i = 0; i < 6; ++i) pose_sums[i] = pose_sums[i] + select(mask, out.pose[i], Lanes(0.0f));
  }
  for (int i = 0; i < 6; ++i) pose[i] += static_cast<double>(hn::GetLane(hn::SumOfLanes(kFloats, pose_sums[i].v)));
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam::splatting {
namespace {

HWY_EXPORT(backward_block);

UpdateConstants make_constants(const TrainOptions& options, int num_visible) {
  UpdateConstants c;
  const LearningRates& rates = options.rates;
  std::fill_n(c.rates + row::kMean, 3, rates.mean);
  std::fill_n(c.rates + row::kRotation, 4, rates.rotation);
  std::fill_n(c.rates + row::kLogScale, 3, rates.log_scale);
  c.rates[row::kOpacity] = rates.opacity;
  std::fill_n(c.rates + row::kSh, 3, rates.sh_dc);
  std::fill(c.rates + row::kSh + 3, c.rates + row::kCount, rates.sh_rest);
  c.beta1 = options.beta1;
  c.beta2 = options.beta2;
  c.epsilon2 = std::max(options.epsilon * options.epsilon, 1e-36f);
  c.log_beta1 = static_cast<float>(std::log(static_cast<double>(options.beta1)));
  c.log_beta2 = static_cast<float>(std::log(static_cast<double>(options.beta2)));
  c.bias_correction = options.bias_correction;
  c.opacity_gradient = options.opacity_weight / static_cast<float>(std::max(num_visible, 1));
  return c;
}

/// Runs the kernel over all visible blocks; the pose is summed per task and then in the order of the tasks.
template <class TargetOf>
void run_backward(Executor& executor, Frame& frame, const GaussianModel& model, const UpdateConstants& constants,
                  TargetOf&& target_of, float pose[6]) {
  std::vector<double> sums(static_cast<size_t>(frame.num_tasks()) * 6, 0.0);
  executor.for_each(frame.num_tasks(), [&](int task, int) {
    const int end = std::min((task + 1) * kBlocksPerTask, frame.num_ranks());
    for (int rank = task * kBlocksPerTask; rank < end; ++rank) {
      const size_t r = static_cast<size_t>(rank), b = frame.blocks[r];
      if (frame.visible[r] == 0) continue;
      if (rank + 1 < frame.num_ranks()) {
        prefetch_parameters(model.block(frame.blocks[r + 1]), frame.sh_degree);
        if (target_of(b).model != nullptr) prefetch_moments(model.block(frame.blocks[r + 1]), frame.sh_degree);
      }
      HWY_DYNAMIC_DISPATCH(backward_block)
      (frame, r, model.block(b), constants, target_of(b), &sums[static_cast<size_t>(task) * 6]);
    }
  });
  double total[6] = {};
  for (size_t i = 0; i < sums.size(); ++i) total[i % 6] += sums[i];
  for (int i = 0; i < 6; ++i) pose[i] = static_cast<float>(total[i]);
}

}  // namespace

void update_model(Executor& executor, Frame& frame, const TrainOptions& options, GaussianModel& model, float pose[6]) {
  const UpdateConstants constants = make_constants(options, frame.num_visible);
  run_backward(
      executor, frame, model, constants,
      [&](size_t b) { return UpdateTarget{options.update ? &model.block(b) : nullptr, nullptr}; }, pose);
  if (!options.update) return;
  executor.for_each(frame.num_tasks(), [&](int task, int) {
    const int end = std::min((task + 1) * kBlocksPerTask, frame.num_ranks());
    for (int rank = task * kBlocksPerTask; rank < end; ++rank)
      if (frame.visible[static_cast<size_t>(rank)] != 0) model.update_bounds(frame.blocks[static_cast<size_t>(rank)]);
  });
}

void dense_gradients(Executor& executor, Frame& frame, const GaussianModel& model, Gradients& gradients) {
  constexpr size_t kBlockValues = static_cast<size_t>(row::kCount) * kBlockSize;
  gradients.values.assign(model.num_blocks() * kBlockValues, 0.0f);
  run_backward(
      executor, frame, model, UpdateConstants{},
      [&](size_t b) { return UpdateTarget{nullptr, gradients.values.data() + b * kBlockValues}; }, gradients.pose);
}

}  // namespace photoslam::splatting
#endif  // HWY_ONCE
