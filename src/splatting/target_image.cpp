// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/target_image.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "image/block_formulas.h"

namespace photoslam::splatting {
namespace {

/// Makes every pixel of a plane at 1/factor of the resolution by pixel(block, pitch, factor) of a block.
template <class T, class Pixel>
void shrink_plane(const T* from, int width, int height, int factor, T* to, Pixel&& pixel) {
  for (int y = 0; y < height / factor; ++y)
    for (int x = 0; x < width / factor; ++x)
      *to++ = pixel(from + static_cast<std::ptrdiff_t>(y * factor) * width + x * factor, static_cast<size_t>(width),
                    static_cast<size_t>(factor));
}

}  // namespace

TargetImage::TargetImage(int width, int height, std::span<const uint8_t> rgb, std::span<const uint8_t> mask)
    : width_(width), height_(height), mask_(mask.begin(), mask.end()) {
  PHOTOSLAM_CHECK(width >= 1 && height >= 1, "{}x{}", width, height);
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  PHOTOSLAM_CHECK(rgb.size() == 3 * pixels, "{} values for {}x{}x3", rgb.size(), width, height);
  PHOTOSLAM_CHECK(mask.empty() || mask.size() == pixels, "mask of {} for {}x{}", mask.size(), width, height);
  planes_.resize(3 * pixels);
  for (size_t i = 0; i < pixels; ++i)
    for (size_t c = 0; c < 3; ++c) planes_[c * pixels + i] = rgb[3 * i + c];
  num_valid_ = static_cast<int>(pixels) - static_cast<int>(std::count(mask_.begin(), mask_.end(), 0));
}

void TargetImage::set_depth(std::span<const uint16_t> depth, float unit) {
  PHOTOSLAM_CHECK(depth.size() * 3 == planes_.size(), "depth of {} for {}x{}", depth.size(), width_, height_);
  PHOTOSLAM_CHECK(unit > 0, "unit {}", unit);
  depth_.assign(depth.begin(), depth.end());
  depth_unit_ = unit;
  remote_.reset();
  smaller_.clear();
  if (has_mask())
    for (size_t i = 0; i < depth_.size(); ++i)
      if (mask_[i] == 0) depth_[i] = 0;
  num_depth_ = static_cast<int>(depth_.size()) - static_cast<int>(std::count(depth_.begin(), depth_.end(), 0));
}

void TargetImage::set_depth(std::span<const float> depth) {
  const auto measured = [](float d) { return std::isfinite(d) && d > 0; };
  float largest = 0;
  for (float d : depth)
    if (measured(d)) largest = std::max(largest, d);
  const float unit = largest > 0 ? largest / 65535.0f : 1.0f;
  std::vector<uint16_t> steps(depth.size(), 0);
  for (size_t i = 0; i < depth.size(); ++i)
    if (measured(depth[i])) steps[i] = static_cast<uint16_t>(std::clamp(std::round(depth[i] / unit), 1.0f, 65535.0f));
  set_depth(steps, unit);
}

const TargetImage& TargetImage::shrunk(int factor, bool with_depth) const {
  PHOTOSLAM_CHECK(factor >= 1 && factor <= std::min(width_, height_), "1/{} of {}x{}", factor, width_, height_);
  if (factor == 1) return *this;
  const auto at = static_cast<size_t>(factor);
  if (smaller_.size() <= at) smaller_.resize(at + 1);
  if (smaller_[at] == nullptr) smaller_[at] = std::make_shared<TargetImage>(shrink_color(factor));
  TargetImage& image = *smaller_[at];
  if (with_depth && has_depth() && !image.has_depth()) image.set_depth(shrink_depth(factor), depth_unit_);
  return image;
}

/// Colours and mask.
TargetImage TargetImage::shrink_color(int factor) const {
  TargetImage result;
  result.width_ = width_ / factor;
  result.height_ = height_ / factor;
  const auto large = planes_.size() / 3,
             small = static_cast<size_t>(result.width_) * static_cast<size_t>(result.height_);
  result.planes_.resize(3 * small);
  for (size_t c = 0; c < 3; ++c)
    shrink_plane(&planes_[c * large], width_, height_, factor, &result.planes_[c * small],
                 [](const uint8_t* block, size_t pitch, size_t size) { return block_mean(block, 1, pitch, size); });
  if (has_mask()) {
    result.mask_.resize(small);
    shrink_plane(mask_.data(), width_, height_, factor, result.mask_.data(),
                 [](const uint8_t* block, size_t pitch, size_t size) -> uint8_t {
                   return block_has_data(block, pitch, size) ? 255 : 0;
                 });
  }
  result.num_valid_ = static_cast<int>(small) - static_cast<int>(std::ranges::count(result.mask_, 0));
  return result;
}

std::vector<uint16_t> TargetImage::shrink_depth(int factor) const {
  std::vector<uint16_t> result(static_cast<size_t>(width_ / factor) * static_cast<size_t>(height_ / factor));
  shrink_plane(depth_.data(), width_, height_, factor, result.data(), block_median);
  return result;
}

}  // namespace photoslam::splatting
