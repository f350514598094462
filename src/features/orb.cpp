// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/orb.h"

#include <cmath>

#include "features/brief.h"
#include "features/corner_refinement.h"
#include "features/distribution.h"
#include "features/fast.h"
#include "features/grey_pyramid.h"

namespace photoslam {

void OrbOptions::visit(OptionVisitor& visitor) {
  visitor.value({"num_features", "", 1, 100000, "Keypoints per image. More are more robust and slower."}, num_features);
  visitor.value({"num_levels", "", 1, 16, "Pyramid levels: the range of scales over which a landmark is recognised."},
                num_levels);
  visitor.value({"scale_factor", "", 1.05, 2, "Size ratio of neighbouring pyramid levels."}, scale_factor);
  visitor.value({"fast_threshold", "grey levels", 1, 254, "Contrast of a corner where the image is rich in corners."},
                fast_threshold);
  visitor.value({"min_fast_threshold", "grey levels", 1, 254,
                 "Contrast of a corner where nothing stronger is around. Lower finds more corners in dim, flat areas."},
                min_fast_threshold);
}

struct OrbExtractor::State {
  OrbOptions options;
  GreyPyramid pyramid;
  CornerDistributor distributor;
  BriefDescriber describer;
  std::vector<Corner> corners, chosen;
  std::vector<uint8_t> scratch, blurred;

  void extract_level(int octave, int count, Features& features);
};

OrbExtractor::OrbExtractor(const OrbOptions& options) : state_(std::make_unique<State>()) {
  PHOTOSLAM_CHECK(options.min_fast_threshold <= options.fast_threshold, "{} > {}", options.min_fast_threshold,
                  options.fast_threshold);
  state_->options = options;
}
OrbExtractor::~OrbExtractor() = default;
OrbExtractor::OrbExtractor(OrbExtractor&&) noexcept = default;
OrbExtractor& OrbExtractor::operator=(OrbExtractor&&) noexcept = default;

const GreyPyramid& OrbExtractor::pyramid() const { return state_->pyramid; }

void OrbExtractor::State::extract_level(int octave, int count, Features& features) {
  const GreyView image = pyramid.level(octave);
  corners.clear();
  detect_fast(image, kPatchRadius + 1, options.min_fast_threshold, scratch, corners);
  distributor.choose(corners, image.width, image.height, count, options.fast_threshold, chosen);
  if (chosen.empty()) return;

  blurred.resize(static_cast<size_t>(image.height * image.stride));
  const MutableGreyView smooth{blurred.data(), image.width, image.height, image.stride};
  blur(image, smooth, scratch);
  const double scale = pyramid.scale(octave);
  for (const Corner& corner : chosen) {
    const float angle = intensity_centroid_angle(image, corner.x, corner.y);
    const CornerPosition position = refine_corner(image, corner.x, corner.y);
    features.keypoints.push_back({.x = static_cast<float>((position.x + 0.5) * scale - 0.5),
                                  .y = static_cast<float>((position.y + 0.5) * scale - 0.5),
                                  .angle = angle,
                                  .response = static_cast<float>(corner.score),
                                  .octave = octave});
    features.descriptors.push_back(describer.describe(smooth, corner.x, corner.y, angle));
  }
}

void OrbExtractor::extract(const ImageU8& grey, Features& features) {
  PHOTOSLAM_CHECK(grey.channels() == 1, "{} channels", grey.channels());
  features.keypoints.clear();
  features.descriptors.clear();
  constexpr int kMinSize = 64;
  if (grey.width() < kMinSize || grey.height() < kMinSize) return;
  const OrbOptions& options = state_->options;
  state_->pyramid.build(grey, options.num_levels, options.scale_factor);

  // Shares of the levels fall like their side lengths. From coarse to fine, so that what a level cannot deliver is left
  // to the finer ones.
  const int num_levels = state_->pyramid.num_levels();
  double remaining_weight = 0;
  for (int i = 0; i < num_levels; ++i) remaining_weight += 1 / state_->pyramid.scale(i);
  for (int i = num_levels - 1; i >= 0; --i) {
    const double weight = 1 / state_->pyramid.scale(i);
    const double remaining = options.num_features - static_cast<double>(features.size());
    state_->extract_level(i, static_cast<int>(std::lround(remaining * weight / remaining_weight)), features);
    remaining_weight -= weight;
  }
}

}  // namespace photoslam
