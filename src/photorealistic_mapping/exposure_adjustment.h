// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include "base/options.h"
#include "photorealistic_mapping/depth_picture.h"
#include "splatting/loss.h"
#include "splatting/renderer.h"

namespace photoslam {

class Archive;

struct ExposureOptions {
  bool enabled = true;
  double gain_rate = 0.003;
  double bias_rate = 0;
  double decay = 0.001;
  void visit(OptionVisitor& visitor);
};

/// How one keyframe's camera rendered brightness, against the gaussians: picture = gain * render + bias, per channel.
/// Starts as identity, or as it is known from elsewhere. The first keyframe is left at it, and the others decay towards
/// it, so that the brightness of the map cannot drift.
class ExposureAdjustment {
 public:
  splatting::Exposure exposure() const;
  /// Moves towards the gains that make a render as bright as the picture, where it is opaque; nothing changes where
  /// that is next to nowhere. The render is compared as training compares it, not divided by its opacity: gaussians
  /// that let a little black through have learnt to be brighter by as much. Sums of all values are compared: noise does
  /// not bend their ratio, and neither does blur, unless values are left out by their brightness. The worse render and
  /// picture agree, the less the ratio counts, for then it tells what the map lacks rather than the exposure. The
  /// picture has the render's size.
  void match(const DepthPicture& picture, const splatting::RenderResult& render);
  /// Takes over what was learnt before; gains are positive.
  void start_from(const splatting::Exposure& exposure);

  /// One step of Adam against dL/d(gain rgb, bias rgb).
  void step(const ExposureOptions& options, double rate_factor, std::span<const float, 6> gradient);
  void serialize(Archive& archive);

 private:
  std::array<double, 6> parameters_{};  // log gain rgb, bias rgb
  std::array<double, 6> first_moment_{}, second_moment_{};
  int steps_ = 0;
};

/// What the camera would have seen: gain * render + bias, in place.
void apply(const splatting::Exposure& exposure, splatting::RenderResult& render);

/// A gaussian whose colour was read off a picture, as it must be to render so under the picture's exposure.
void remove(const splatting::Exposure& exposure, splatting::Gaussian& gaussian);

}  // namespace photoslam
