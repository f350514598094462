// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace photoslam {
namespace {

constexpr int kRadius = 5;
constexpr int kTaps = 2 * kRadius + 1;

void check_pair(const ImageF& a, const ImageF& b, const ImageU8& mask) {
  PHOTOSLAM_CHECK(a.same_size(b) && a.channels() == b.channels(), "{}x{}x{} and {}x{}x{}", a.width(), a.height(),
                  a.channels(), b.width(), b.height(), b.channels());
  PHOTOSLAM_CHECK(!a.empty(), "empty images");
  PHOTOSLAM_CHECK(mask.empty() || (mask.same_size(a) && mask.channels() == 1), "a mask of {}x{}x{}", mask.width(),
                  mask.height(), mask.channels());
}

/// In [0, 1]; what is not a number counts as 0.
float clamped(float v) { return v > 0.0f ? std::min(v, 1.0f) : 0.0f; }

/// One half of the symmetric window of SSIM, from the centre outwards; the whole sums to 1.
std::array<float, kRadius + 1> gaussian_window() {
  constexpr double kSigma = 1.5;
  std::array<double, kRadius + 1> weights{};
  double sum = 0;
  for (int i = 0; i <= kRadius; ++i) {
    weights[static_cast<size_t>(i)] = std::exp(-i * i / (2 * kSigma * kSigma));
    sum += (i == 0 ? 1 : 2) * weights[static_cast<size_t>(i)];
  }
  std::array<float, kRadius + 1> window{};
  for (size_t i = 0; i < window.size(); ++i) window[i] = static_cast<float>(weights[i] / sum);
  return window;
}

/// For each window position (x, y) of the image whose window lies inside: 1 if the mask has no 0 in it.
/// Result is [height − 10, width − 10], indexed by the window's top left corner.
ImageU8 windows_with_data(const ImageU8& mask) {
  ImageU8 across(mask.width() - 2 * kRadius, mask.height());
  for (int y = 0; y < mask.height(); ++y) {
    const uint8_t* const row = mask.row(y);
    for (int x = 0; x < across.width(); ++x) {
      across(x, y) = std::all_of(row + x, row + x + kTaps, [](uint8_t m) { return m != 0; }) ? 1 : 0;
    }
  }
  ImageU8 whole(across.width(), mask.height() - 2 * kRadius, 1, 1);
  for (int y = 0; y < whole.height(); ++y) {
    for (int dy = 0; dy < kTaps; ++dy) {
      for (int x = 0; x < whole.width(); ++x) whole(x, y) &= across(x, y + dy);
    }
  }
  return whole;
}

/// Weighted means of eleven values, along rows and columns of the window alike.
class WindowMean {
 public:
  /// target[i] = Σ_k w_k source(k)[i] for i in [0, count); target overlaps no source.
  template <class Source>
  void operator()(const Source& source, float* __restrict target, size_t count) const {
    const auto [w0, w1, w2, w3, w4, w5] = window_;
    const float *s0 = source(0), *s1 = source(1), *s2 = source(2), *s3 = source(3), *s4 = source(4), *s5 = source(5),
                *s6 = source(6), *s7 = source(7), *s8 = source(8), *s9 = source(9), *s10 = source(10);
    for (size_t i = 0; i < count; ++i) {
      target[i] = w0 * s5[i] + w1 * (s4[i] + s6[i]) + w2 * (s3[i] + s7[i]) + w3 * (s2[i] + s8[i]) +
                  w4 * (s1[i] + s9[i]) + w5 * (s0[i] + s10[i]);
    }
  }

 private:
  std::array<float, kRadius + 1> window_ = gaussian_window();
};

/// The moments of a pair of pixels that SSIM averages over its window: a, b, a² + b², ab.
constexpr size_t kMoments = 4;
using MomentRows = std::array<std::vector<float>, kMoments>;

/// SSIM of one row of windows after another, from top to bottom, channels interleaved.
class SsimRows {
 public:
  SsimRows(const ImageF& a, const ImageF& b)
      : a_(a),
        b_(b),
        step_(static_cast<size_t>(a.channels())),
        width_(static_cast<size_t>(a.width()) * step_),
        windows_(width_ - 2 * kRadius * step_),
        similarity_(windows_) {
    for (auto& row : pixels_) row.resize(width_);
    for (auto& row : means_) row.resize(windows_);
    for (auto& rows : blurred_) {
      for (auto& row : rows) row.resize(windows_);
    }
    for (int y = 0; y < kTaps - 1; ++y) blur_across(y);
  }

  /// The next row: [(width − 10) * channels].
  const std::vector<float>& next() {
    blur_across(top_ + kTaps - 1);
    for (size_t m = 0; m < kMoments; ++m) {
      const auto row = [&](int k) { return blurred_[static_cast<size_t>((top_ + k) % kTaps)][m].data(); };
      mean_(row, means_[m].data(), windows_);
    }
    compare();
    ++top_;
    return similarity_;
  }

 private:
  /// Horizontal window means of image row y. Values are centred on ½, which costs fewer digits.
  void blur_across(int y) {
    const float* const a = a_.row(y);
    const float* const b = b_.row(y);
    auto& [pa, pb, squares, product] = pixels_;
    float *__restrict const pa_row = pa.data(), *__restrict const pb_row = pb.data(),
          *__restrict const squares_row = squares.data(), *__restrict const product_row = product.data();
    for (size_t i = 0; i < width_; ++i) {
      const float u = clamped(a[i]) - 0.5f, v = clamped(b[i]) - 0.5f;
      pa_row[i] = u;
      pb_row[i] = v;
      squares_row[i] = u * u + v * v;
      product_row[i] = u * v;
    }
    MomentRows& target = blurred_[static_cast<size_t>(y % kTaps)];
    for (size_t m = 0; m < kMoments; ++m) {
      const auto column = [&](size_t k) { return pixels_[m].data() + k * step_; };
      mean_(column, target[m].data(), windows_);
    }
  }

  void compare() {
    constexpr float kC1 = 0.01f * 0.01f, kC2 = 0.03f * 0.03f;
    const float *const a = means_[0].data(), *const b = means_[1].data(), *const squares = means_[2].data(),
                       *const product = means_[3].data();
    float* __restrict const target = similarity_.data();
    for (size_t i = 0; i < windows_; ++i) {
      const float mean_a = a[i] + 0.5f, mean_b = b[i] + 0.5f;
      const float variances = squares[i] - a[i] * a[i] - b[i] * b[i];
      const float covariance = product[i] - a[i] * b[i];
      target[i] = (2 * mean_a * mean_b + kC1) * (2 * covariance + kC2) /
                  ((mean_a * mean_a + mean_b * mean_b + kC1) * (variances + kC2));
    }
  }

  const ImageF& a_;
  const ImageF& b_;
  const size_t step_;     // values from one pixel to the next
  const size_t width_;    // values in an image row
  const size_t windows_;  // values in a row of windows
  const WindowMean mean_;
  MomentRows pixels_;
  std::array<MomentRows, kTaps> blurred_;  // image row y at y % kTaps
  MomentRows means_;
  std::vector<float> similarity_;
  int top_ = 0;
};

}  // namespace

double psnr(const ImageF& a, const ImageF& b, const ImageU8& mask) {
  check_pair(a, b, mask);
  double sum = 0;
  size_t count = 0;
  for (int y = 0; y < a.height(); ++y) {
    const float* pa = a.row(y);
    const float* pb = b.row(y);
    float row_sum = 0;
    for (int x = 0; x < a.width(); ++x, pa += a.channels(), pb += a.channels()) {
      if (!mask.empty() && mask(x, y) == 0) continue;
      for (int c = 0; c < a.channels(); ++c) {
        const float difference = clamped(pa[c]) - clamped(pb[c]);
        row_sum += difference * difference;
      }
      ++count;
    }
    sum += row_sum;
  }
  PHOTOSLAM_CHECK(count > 0, "the mask selects no pixel");
  const double mean = sum / static_cast<double>(count * static_cast<size_t>(a.channels()));
  return mean > 0 ? std::min(-10 * std::log10(mean), kLargestPsnr) : kLargestPsnr;
}

double ssim(const ImageF& a, const ImageF& b, const ImageU8& mask) {
  check_pair(a, b, mask);
  PHOTOSLAM_CHECK(a.width() >= kTaps && a.height() >= kTaps, "{}x{}", a.width(), a.height());
  const ImageU8 selected = mask.empty() ? ImageU8{} : windows_with_data(mask);
  const int channels = a.channels();
  SsimRows rows(a, b);
  double sum = 0;
  size_t count = 0;
  for (int y = 0; y < a.height() - 2 * kRadius; ++y) {
    const std::vector<float>& row = rows.next();
    const float* value = row.data();
    for (int x = 0; x < a.width() - 2 * kRadius; ++x, value += channels) {
      if (!mask.empty() && selected(x, y) == 0) continue;
      for (int c = 0; c < channels; ++c) sum += value[c];
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<double>(count * static_cast<size_t>(channels))
                   : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace photoslam
