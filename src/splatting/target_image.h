// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace photoslam::splatting {

/// What a view should look like: 8-bit colours, optionally a mask and metric depth, kept compactly.
class TargetImage {
 public:
  TargetImage() = default;
  /// `rgb` is interleaved [H, W, 3]. `mask`, when not empty, is [H, W]: 0 = no data, the pixel does not count.
  TargetImage(int width, int height, std::span<const uint8_t> rgb, std::span<const uint8_t> mask = {});

  /// Depth [H, W] in units of `unit` metres; 0 = not measured.
  void set_depth(std::span<const uint16_t> depth, float unit);
  /// Depth [H, W] in metres; not finite or <= 0 = not measured. Stored in 16 bits, steps of max/65535.
  void set_depth(std::span<const float> depth);

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return planes_.empty(); }
  bool has_mask() const { return !mask_.empty(); }
  bool has_depth() const { return !depth_.empty(); }

  std::span<const uint8_t> planes() const { return planes_; }  // [3, H, W]
  std::span<const uint8_t> mask() const { return mask_; }      // [H, W] or empty
  std::span<const uint16_t> depth() const { return depth_; }   // [H, W] or empty
  float depth_unit() const { return depth_unit_; }

  /// Number of pixels with data, and of those with depth.
  int num_valid() const { return num_valid_; }
  int num_depth() const { return num_depth_; }

  /// The image at 1/factor of its resolution, as shrink() in image/pyramid.h makes it: when first asked for, its depth
  /// when that is first asked for. For one thread at a time.
  const TargetImage& shrunk(int factor, bool with_depth) const;

  /// What a GPU remembers of this image: lives as long as the image stays as it is.
  const std::shared_ptr<void>& remote() const { return remote_; }
  void set_remote(std::shared_ptr<void> remote) const { remote_ = std::move(remote); }

 private:
  TargetImage shrink_color(int factor) const;
  std::vector<uint16_t> shrink_depth(int factor) const;

  int width_ = 0, height_ = 0;
  std::vector<uint8_t> planes_;
  std::vector<uint8_t> mask_;
  std::vector<uint16_t> depth_;
  float depth_unit_ = 0;
  int num_valid_ = 0;
  int num_depth_ = 0;
  mutable std::shared_ptr<void> remote_;
  mutable std::vector<std::shared_ptr<TargetImage>> smaller_;  // by factor; null: nobody has asked
};

}  // namespace photoslam::splatting
