// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/detail.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/check.h"

namespace photoslam {
namespace {

constexpr int kFactor = 8;

/// Weights of the four neighbours for a place t in [0, 1) behind the second one. Source: Keys, "Cubic convolution
/// interpolation for digital image processing", 1981, with a = −0.75 as image libraries have it.
std::array<float, 4> cubic_weights(float t) {
  constexpr float a = -0.75f;
  const auto inner = [](float x) { return ((a + 2) * x - (a + 3)) * x * x + 1; };
  const auto outer = [](float x) { return ((a * x - 5 * a) * x + 8 * a) * x - 4 * a; };
  return {outer(t + 1), inner(t), inner(1 - t), outer(2 - t)};
}

/// Enlarges the rows of an image kFactor times.
ImageF enlarge_rows(const ImageF& image) {
  ImageF out(image.width() * kFactor, image.height());
  for (int x = 0; x < out.width(); ++x) {
    const float at = (static_cast<float>(x) + 0.5f) / kFactor - 0.5f;
    const int i = static_cast<int>(std::floor(at));
    const std::array<float, 4> weights = cubic_weights(at - static_cast<float>(i));
    for (int y = 0; y < out.height(); ++y) {
      float sum = 0;
      for (int k = 0; k < 4; ++k)
        sum += weights[static_cast<size_t>(k)] * image(std::clamp(i + k - 1, 0, image.width() - 1), y);
      out(x, y) = sum;
    }
  }
  return out;
}

ImageF transposed(const ImageF& image) {
  ImageF out(image.height(), image.width());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) out(y, x) = image(x, y);
  }
  return out;
}

/// Squared error of one channel after shrinking and enlarging.
double loss_of_detail(const ImageU8& color, int channel) {
  ImageF small(color.width() / kFactor, color.height() / kFactor);
  for (int y = 0; y < small.height() * kFactor; ++y) {
    for (int x = 0; x < small.width() * kFactor; ++x) {
      small(x / kFactor, y / kFactor) += static_cast<float>(color(x, y, channel)) / (kFactor * kFactor);
    }
  }
  const ImageF large = transposed(enlarge_rows(transposed(enlarge_rows(small))));
  double sum = 0;
  for (int y = 0; y < large.height(); ++y) {
    for (int x = 0; x < large.width(); ++x) {
      const double difference = std::clamp(large(x, y), 0.0f, 255.0f) - static_cast<float>(color(x, y, channel));
      sum += difference * difference;
    }
  }
  return sum / large.width() / large.height();
}

}  // namespace

DetailFigures measure_detail(const ImageU8& color) {
  PHOTOSLAM_CHECK(color.channels() == 3 && color.width() >= 16 && color.height() >= 16, "{}x{}x{}", color.width(),
                  color.height(), color.channels());
  DetailFigures figures;
  double squared = 0;
  for (int c = 0; c < 3; ++c) squared += loss_of_detail(color, c) / 3;
  figures.shrunk_psnr_db = 10 * std::log10(255.0 * 255.0 / std::max(squared, 1e-6));

  const auto grey = [&](int x, int y) {
    return 0.299 * color(x, y, 0) + 0.587 * color(x, y, 1) + 0.114 * color(x, y, 2);
  };
  double sum = 0;
  for (int y = 0; y < color.height(); ++y) {
    for (int x = 1; x < color.width(); ++x) sum += std::abs(grey(x, y) - grey(x - 1, y));
  }
  figures.horizontal_difference = sum / (color.width() - 1) / color.height();
  return figures;
}

}  // namespace photoslam
