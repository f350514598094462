// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/executor.h"
#include "image/image.h"
#include "sources/synthetic/textures/color.h"

namespace photoslam::synthetic {

/// Colour of a surface point, in metres from the upper left corner. Pure: called from several threads.
using Shader = std::function<Color(float x, float y)>;

/// A colour image with prefiltered smaller copies, mirrored at its edges without end unless it repeats.
class Texture {
 public:
  Texture() = default;

  /// Evaluates the shader at the texel centres of a `width` x `height` metres surface.
  static Texture paint(float width, float height, float texels_per_metre, const Shader& shader, Executor& executor);

  /// An image one metre wide that repeats without end, as images on meshes do. 1 or 3 channels.
  static Texture from_image(const ImageU8& image, Executor& executor);

  float width() const { return width_; }    ///< [m]
  float height() const { return height_; }  ///< [m]
  float texels_per_metre() const { return texels_per_metre_; }

  /// Linear reflectance (and gloss) around the point (x, y) [m], averaged over about `footprint` metres.
  Color sample(float x, float y, float footprint) const;

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<uint32_t> texels;  // display values, 8 bits each, red lowest
  };

  Color bilinear(const Level& level, float x, float y) const;
  void add_smaller_levels();
  static Level shrink(const Level& level);

  float width_ = 0, height_ = 0, texels_per_metre_ = 1;
  bool repeats_ = false;
  std::vector<Level> levels_;
};

}  // namespace photoslam::synthetic
