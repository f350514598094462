// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/loss.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/check.h"
#include "splatting/cpu/targets.h"
#include "splatting/loss_constants.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splatting/loss.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "splatting/cpu/lanes-inl.h"

#ifndef PHOTOSLAM_SPLATTING_LOSS_ONCE
#define PHOTOSLAM_SPLATTING_LOSS_ONCE
namespace photoslam::splatting {

/// One channel of the comparison, and a band of its rows.
struct LossBand {
  const float* render;    // [H, W]
  const uint8_t* target;  // [H, W]
  const uint8_t* mask;    // [H, W] or null
  float* gradient;        // [H, W] dL/d(render)
  int width, height;
  int begin, end;  ///< Rows of the band.
  float gain, bias;
  float l1_scale;    ///< (1 − λ) / number of compared values
  float ssim_scale;  ///< λ / number of compared values
};

inline constexpr int kRadius = kSsimRadius;
inline constexpr int kWindow = 2 * kRadius + 1;
/// Zeros on either side of a row, and lanes to run over its end.
inline constexpr size_t kPad = 16;
inline constexpr int kSignals = 4;      ///< Filtered forwards: a, b, a² + b², a b.
inline constexpr int kDerivatives = 3;  ///< Filtered backwards: dS/d(mean a), dS/d(mean a²), dS/d(mean ab).

/// Floats from row to row: an odd number of cache lines, so that the rows above each other do not share cache sets.
constexpr size_t padded_width(int width) { return (((static_cast<size_t>(width) + 15) / 16 + 2 * kPad / 16) | 1) * 16; }
/// Floats of scratch memory for one band.
constexpr size_t scratch_size(int width) {
  return padded_width(width) * static_cast<size_t>(kSignals + kDerivatives) * (kWindow + 1);
}

}  // namespace photoslam::splatting
#endif

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {

inline constexpr float kTaps[kRadius + 1] = {kSsimTap0, kSsimTap1, kSsimTap2, kSsimTap3, kSsimTap4, kSsimTap5};

/// The compared values of row y: exposure applied, zero where there is no data. Writes [0, width) of both.
void load_row(const LossBand& band, int y, float* HWY_RESTRICT a, float* HWY_RESTRICT b) {
  const size_t row = static_cast<size_t>(y) * static_cast<size_t>(band.width);
  const size_t width = static_cast<size_t>(band.width);
  const float* HWY_RESTRICT render = band.render + row;
  const uint8_t* HWY_RESTRICT target = band.target + row;
  for (size_t x = 0; x < width; ++x) a[x] = band.gain * render[x] + band.bias;
  for (size_t x = 0; x < width; ++x) b[x] = static_cast<float>(target[x]) * (1.0f / 255.0f);
  if (band.mask == nullptr) return;
  const uint8_t* HWY_RESTRICT mask = band.mask + row;
  for (size_t x = 0; x < width; ++x) a[x] = mask[x] != 0 ? a[x] : 0.0f;
  for (size_t x = 0; x < width; ++x) b[x] = mask[x] != 0 ? b[x] : 0.0f;
}

/// Filters a row horizontally. `in` has kPad zeros before and at least kRadius after its content.
void filter_row(const float* in, size_t width, float* out) {
  for (size_t x = 0; x < width; x += kLanes) {
    Vec sum = hn::Mul(hn::Set(kFloats, kTaps[0]), hn::LoadU(kFloats, in + x));
    for (int k = 1; k <= kRadius; ++k)
      sum = hn::MulAdd(hn::Set(kFloats, kTaps[k]),
                       hn::Add(hn::LoadU(kFloats, in + x - k), hn::LoadU(kFloats, in + x + k)), sum);
    hn::Store(sum, kFloats, out + x);
  }
}

/// The rows around row y of a ring of kWindow rows: pointers from y − 5 to y + 5.
struct Column {
  const float* rows[kWindow];
  HWY_INLINE Column(const float* ring, size_t stride, int y) {
    for (int k = 0; k < kWindow; ++k)
      rows[k] = ring + static_cast<size_t>((y - kRadius + k + 2 * kWindow) % kWindow) * stride;
  }
  HWY_INLINE Vec filter(size_t x) const {
    Vec sum = hn::Mul(hn::Set(kFloats, kTaps[0]), hn::Load(kFloats, rows[kRadius] + x));
    for (int k = 1; k <= kRadius; ++k)
      sum =
          hn::MulAdd(hn::Set(kFloats, kTaps[k]),
                     hn::Add(hn::Load(kFloats, rows[kRadius - k] + x), hn::Load(kFloats, rows[kRadius + k] + x)), sum);
    return sum;
  }
};

/// SSIM and its derivatives by the three filtered quantities that depend on the render, for one row.
/// Returns the row's sum of SSIM.
double compare_row(const LossBand& band, const Column* signals, int y, float* const* derivatives) {
  const size_t width = static_cast<size_t>(band.width);
  const Vec c1 = hn::Set(kFloats, kSsimC1), c2 = hn::Set(kFloats, kSsimC2), two = hn::Set(kFloats, 2.0f);
  alignas(64) float mask[16];
  Vec total = hn::Zero(kFloats);
  for (size_t x = 0; x < width; x += kLanes) {
    const Vec mu_a = signals[0].filter(x), mu_b = signals[1].filter(x);
    const Vec squares = hn::Add(hn::Mul(mu_a, mu_a), hn::Mul(mu_b, mu_b)), product = hn::Mul(mu_a, mu_b);
    const Vec a1 = hn::MulAdd(two, product, c1);
    const Vec a2 = hn::MulAdd(two, hn::Sub(signals[3].filter(x), product), c2);
    const Vec b1 = hn::Add(squares, c1);
    const Vec b2 = hn::Add(hn::Sub(signals[2].filter(x), squares), c2);
    const Vec inv_b1 = reciprocal(b1), inv_b2 = reciprocal(b2);
    const Vec inv = hn::Mul(inv_b1, inv_b2);
    Vec valid = hn::Set(kFloats, 1.0f);
    if (band.mask != nullptr || x + kLanes > width) {
      const uint8_t* row = band.mask == nullptr ? nullptr : band.mask + static_cast<size_t>(y) * width;
      for (size_t i = 0; i < kLanes; ++i) mask[i] = x + i < width && (row == nullptr || row[x + i] != 0) ? 1.0f : 0.0f;
      valid = hn::Load(kFloats, mask);
    }
    const Vec ssim = hn::Mul(hn::Mul(hn::Mul(a1, a2), inv), valid);
    total = hn::Add(total, ssim);
    // dS/d(mean a) = 2 mu_b (a2 − a1) / (b1 b2) + 2 mu_a S (1/b2 − 1/b1)
    const Vec cross = hn::Mul(hn::Mul(mu_b, hn::Sub(a2, a1)), hn::Mul(inv, valid));
    const Vec by_mean = hn::MulAdd(hn::Mul(mu_a, ssim), hn::Sub(inv_b2, inv_b1), cross);
    hn::Store(hn::Mul(two, by_mean), kFloats, derivatives[0] + x);
    hn::Store(hn::Neg(hn::Mul(ssim, inv_b2)), kFloats, derivatives[1] + x);
    hn::Store(hn::Mul(two, hn::Mul(hn::Mul(a1, inv), valid)), kFloats, derivatives[2] + x);
  }
  return static_cast<double>(hn::GetLane(hn::SumOfLanes(kFloats, total)));
}

/// Writes dL/d(render) of row y and adds up L1, squared error and exposure gradients. `ssim_gradient` [width] is
/// dSSIM/da, or null; a and b are the row's compared values, zero beyond the width.
void finish_row(const LossBand& band, int y, const float* a, const float* b, float* ssim_gradient, LossSums& sums) {
  const size_t width = static_cast<size_t>(band.width), row = static_cast<size_t>(y) * width;
  const Vec zero = hn::Zero(kFloats), one = hn::Set(kFloats, 1.0f);
  const Vec l1_scale = hn::Set(kFloats, band.l1_scale), ssim_scale = hn::Set(kFloats, band.ssim_scale);
  Vec l1 = zero, mse = zero, bias = zero, by_value = zero;
  for (size_t x = 0; x < width; x += kLanes) {
    const Vec va = hn::Load(kFloats, a + x), vb = hn::Load(kFloats, b + x);
    const Vec difference = hn::Sub(va, vb), size = hn::Abs(difference);
    l1 = hn::Add(l1, size);
    const Vec clamped = hn::Sub(hn::Min(hn::Max(va, zero), one), vb);
    mse = hn::MulAdd(clamped, clamped, mse);
    Vec gradient = hn::IfThenElseZero(hn::Gt(size, zero), hn::CopySign(l1_scale, difference));
    gradient = hn::NegMulAdd(ssim_scale, hn::Load(kFloats, ssim_gradient + x), gradient);
    bias = hn::Add(bias, gradient);
    by_value = hn::MulAdd(gradient, va, by_value);
    hn::Store(hn::Mul(gradient, hn::Set(kFloats, band.gain)), kFloats, ssim_gradient + x);
  }
  std::memcpy(band.gradient + row, ssim_gradient, width * sizeof(float));
  const auto sum = [](Vec v) { return static_cast<double>(hn::GetLane(hn::SumOfLanes(kFloats, v))); };
  sums.l1 += sum(l1);
  sums.mse += sum(mse);
  sums.bias += sum(bias);
  sums.value += sum(by_value);
}

/// dSSIM/da where there is data: the derivatives filtered once more, and zero elsewhere.
void gather_ssim_gradient(const LossBand& band, const Column* derivatives, int y, const float* a, const float* b,
                          float* out) {
  const size_t width = static_cast<size_t>(band.width);
  for (size_t x = 0; x < width; x += kLanes) {
    const Vec va = hn::Load(kFloats, a + x), vb = hn::Load(kFloats, b + x);
    Vec sum = hn::MulAdd(hn::Add(va, va), derivatives[1].filter(x), derivatives[0].filter(x));
    hn::Store(hn::MulAdd(vb, derivatives[2].filter(x), sum), kFloats, out + x);
  }
  std::fill(out + width, out + (width + 15) / 16 * 16, 0.0f);
  if (band.mask == nullptr) return;
  const uint8_t* mask = band.mask + static_cast<size_t>(y) * width;
  for (size_t x = 0; x < width; ++x) out[x] = mask[x] != 0 ? out[x] : 0.0f;
}

/// L1 and SSIM of a band in one sweep: input rows run 10 ahead of the gradient rows, through two rings of 11 rows.
void ssim_band(const LossBand& band, float* scratch, LossSums& sums) {
  const size_t width = static_cast<size_t>(band.width), stride = padded_width(band.width);
  std::fill_n(scratch, scratch_size(band.width), 0.0f);
  float* const signal_rings = scratch;                                         // [kSignals, kWindow, stride]
  float* const derivative_rings = signal_rings + kSignals * kWindow * stride;  // [kDerivatives, kWindow, stride]
  float* rows[kSignals + kDerivatives];
  for (size_t i = 0; i < kSignals + kDerivatives; ++i)
    rows[i] = derivative_rings + (kDerivatives * kWindow + i) * stride + kPad;
  const auto slot = [](int y) { return static_cast<size_t>((y + 2 * kWindow) % kWindow); };
  const auto ring_row = [&](float* rings, int i, int y) {
    return rings + (static_cast<size_t>(i) * kWindow + slot(y)) * stride;
  };
  const auto columns = [&](const float* rings, int i, int y) {
    return Column(rings + static_cast<size_t>(i) * kWindow * stride, stride, y);
  };

  for (int in = band.begin - 2 * kRadius; in < band.end + 2 * kRadius; ++in) {
    const bool inside = in >= 0 && in < band.height;
    if (inside) {
      load_row(band, in, rows[0], rows[1]);
      for (size_t x = 0; x < width; x += kLanes) {
        const Vec a = hn::Load(kFloats, rows[0] + x), b = hn::Load(kFloats, rows[1] + x);
        hn::Store(hn::MulAdd(a, a, hn::Mul(b, b)), kFloats, rows[2] + x);
        hn::Store(hn::Mul(a, b), kFloats, rows[3] + x);
      }
    }
    for (int i = 0; i < kSignals; ++i) {
      float* out = ring_row(signal_rings, i, in);
      if (inside)
        filter_row(rows[i], width, out);
      else
        std::fill_n(out, stride, 0.0f);
    }
    const int middle = in - kRadius;
    if (middle < band.begin - kRadius) continue;
    const bool compare = middle >= 0 && middle < band.height;
    if (compare) {
      const Column signals[kSignals] = {columns(signal_rings, 0, middle), columns(signal_rings, 1, middle),
                                        columns(signal_rings, 2, middle), columns(signal_rings, 3, middle)};
      const double ssim = compare_row(band, signals, middle, rows + kSignals);
      if (middle >= band.begin && middle < band.end) sums.ssim += ssim;
    }
    for (int i = 0; i < kDerivatives; ++i) {
      float* out = ring_row(derivative_rings, i, middle);
      if (compare)
        filter_row(rows[kSignals + i], width, out);
      else
        std::fill_n(out, stride, 0.0f);
    }
    const int done = middle - kRadius;
    if (done < band.begin) continue;
    const Column derivatives[kDerivatives] = {columns(derivative_rings, 0, done), columns(derivative_rings, 1, done),
                                              columns(derivative_rings, 2, done)};
    load_row(band, done, rows[0], rows[1]);
    gather_ssim_gradient(band, derivatives, done, rows[0], rows[1], rows[2]);
    finish_row(band, done, rows[0], rows[1], rows[2], sums);
    std::fill_n(rows[2] + width, kPad, 0.0f);
  }
}

void l1_band(const LossBand& band, float* scratch, LossSums& sums) {
  const size_t stride = padded_width(band.width);
  std::fill_n(scratch, 3 * stride, 0.0f);
  for (int y = band.begin; y < band.end; ++y) {
    load_row(band, y, scratch, scratch + stride);
    std::fill_n(scratch + 2 * stride, stride, 0.0f);
    finish_row(band, y, scratch, scratch + stride, scratch + 2 * stride, sums);
  }
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam::splatting {
namespace {

HWY_EXPORT(ssim_band);
HWY_EXPORT(l1_band);

/// Bands per channel: tall enough that the 20 rows computed twice between neighbours matter little, an even number to
/// share the work. Depends on the image alone, so that sums do not depend on the number of threads.
int num_bands(int height) { return height < 64 ? 1 : 2 * ((height + 383) / 384); }

}  // namespace

PhotometricLoss LossFunction::evaluate(std::span<const float> rgb, const TargetImage& target, float ssim_weight,
                                       const Exposure& exposure, Executor& executor, std::vector<float>& dl_drgb) {
  const int width = target.width(), height = target.height();
  const size_t plane = static_cast<size_t>(width) * static_cast<size_t>(height);
  PHOTOSLAM_CHECK(rgb.size() == 3 * plane && plane > 0, "render of {} values, target {}x{}", rgb.size(), width, height);
  dl_drgb.resize(3 * plane);
  const int bands = num_bands(height), band_rows = (height + bands - 1) / bands;
  const double values = 3.0 * std::max(target.num_valid(), 1);
  std::vector<LossSums> sums(static_cast<size_t>(3 * bands));
  const size_t slice = (scratch_size(width) + 15) / 16 * 16;
  scratch_.reserve(slice * static_cast<size_t>(executor.concurrency()));
  executor.for_each(3 * bands, [&](int task, int worker) {
    const size_t c = static_cast<size_t>(task / bands);
    const int begin = (task % bands) * band_rows;
    const LossBand band{.render = rgb.data() + c * plane,
                        .target = target.planes().data() + c * plane,
                        .mask = target.has_mask() ? target.mask().data() : nullptr,
                        .gradient = dl_drgb.data() + c * plane,
                        .width = width,
                        .height = height,
                        .begin = begin,
                        .end = std::min(begin + band_rows, height),
                        .gain = exposure.gain[c],
                        .bias = exposure.bias[c],
                        .l1_scale = static_cast<float>((1 - static_cast<double>(ssim_weight)) / values),
                        .ssim_scale = static_cast<float>(static_cast<double>(ssim_weight) / values)};
    float* scratch = scratch_.data() + slice * static_cast<size_t>(worker);
    LossSums& out = sums[static_cast<size_t>(task)];
    if (ssim_weight > 0)
      HWY_DYNAMIC_DISPATCH(ssim_band)(band, scratch, out);
    else
      HWY_DYNAMIC_DISPATCH(l1_band)(band, scratch, out);
  });

  LossSums channels[3];
  for (size_t i = 0; i < sums.size(); ++i) {
    LossSums& channel = channels[i / static_cast<size_t>(bands)];
    channel.l1 += sums[i].l1;
    channel.ssim += sums[i].ssim;
    channel.mse += sums[i].mse;
    channel.value += sums[i].value;
    channel.bias += sums[i].bias;
  }
  return summarize(channels, target.num_valid(), ssim_weight, exposure);
}

PhotometricLoss summarize(const LossSums (&channels)[3], int num_valid, float ssim_weight, const Exposure& exposure) {
  PhotometricLoss result;
  double l1 = 0, ssim = 0, mse = 0;
  for (size_t c = 0; c < 3; ++c) {
    l1 += channels[c].l1;
    ssim += channels[c].ssim;
    mse += channels[c].mse;
    // From Σ g (gain r + bias) to Σ g r.
    const double g = static_cast<double>(exposure.gain[c]), b = static_cast<double>(exposure.bias[c]);
    result.exposure_gradient[c] = static_cast<float>(g != 0 ? (channels[c].value - b * channels[c].bias) / g : 0);
    result.exposure_gradient[3 + c] = static_cast<float>(channels[c].bias);
  }
  const double lambda = static_cast<double>(ssim_weight), values = 3.0 * std::max(num_valid, 1);
  result.l1 = static_cast<float>(l1 / values);
  result.ssim = static_cast<float>(ssim / values);
  result.mse = static_cast<float>(mse / values);
  result.loss = static_cast<float>((1 - lambda) * l1 / values + (lambda > 0 ? lambda * (1 - ssim / values) : 0));
  return result;
}

float depth_loss(std::span<const float> depth, std::span<const float> alpha, const TargetImage& target, float weight,
                 std::vector<float>& dl_ddepth, std::vector<float>& dl_dalpha) {
  const std::span<const uint16_t> truth = target.depth();
  PHOTOSLAM_CHECK(depth.size() == truth.size() && alpha.size() == truth.size(), "{} rendered, {} true depths",
                  depth.size(), truth.size());
  dl_ddepth.resize(truth.size());
  dl_dalpha.resize(truth.size());
  const float scale = weight / static_cast<float>(std::max(target.num_depth(), 1));
  double sum = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const float d = static_cast<float>(truth[i]) * target.depth_unit();
    const float residual = truth[i] != 0 ? depth[i] - alpha[i] * d : 0.0f;
    const float sign = static_cast<float>((residual > 0) - (residual < 0)) * scale;
    dl_ddepth[i] = sign;
    dl_dalpha[i] = -sign * d;
    sum += static_cast<double>(std::abs(residual));
  }
  return static_cast<float>(sum / std::max(target.num_depth(), 1));
}

}  // namespace photoslam::splatting
#endif  // HWY_ONCE
