// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/target_image.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace photoslam::splatting {

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

}  // namespace photoslam::splatting
