// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/feature_frame_builder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "math/median.h"

namespace photoslam {

void DepthOptions::visit(OptionVisitor& v) {
  v.value({"virtual_baseline_m", "m", 0.01, 1.0, "Turns depth into a disparity; larger trusts depth more."},
          virtual_baseline_m);
  v.value({"min_m", "m", 0.0, 10.0, "Depth below this counts as missing."}, min_m);
  v.value({"max_m", "m", 0.5, 1000.0, "Depth above this counts as missing."}, max_m);
  v.value({"max_edge_ratio", "", 0.0, 1.0,
           "Relative depth step in a 3x3 patch above which a keypoint has no depth, if noise does not explain it."},
          max_edge_ratio);
}

FeatureFrameBuilder::FeatureFrameBuilder(const OrbOptions& orb, const DepthOptions& depth, const StereoOptions& stereo,
                                         const PinholeCamera& camera, const DepthSensor& sensor, ImageU8 mask)
    : orb_options_(orb),
      depth_options_(depth),
      sensor_(sensor),
      bf_(camera.fx * (sensor.metres_per_unit > 0 ? depth.virtual_baseline_m : sensor.baseline_m)),
      mask_(std::move(mask)),
      extractor_(orb),
      stereo_matcher_(stereo) {
  if (std::ranges::all_of(mask_.values(), [](uint8_t has_data) { return has_data != 0; })) mask_ = {};
}

/// Whether the patch that is described reaches into what has no data: by eight points of its rim, which suffice for a
/// smooth border. What lies outside the image is none.
bool FeatureFrameBuilder::is_beside_no_data(const Keypoint& keypoint) const {
  constexpr double kPatchRadius = 16;  // of orientation and descriptor, on the keypoint's level [px]
  const double radius = kPatchRadius * std::pow(orb_options_.scale_factor, keypoint.octave);
  for (int i = 0; i < 8; ++i) {
    const double angle = i * std::numbers::pi / 4;
    const auto x = std::lround(static_cast<double>(keypoint.x) + radius * std::cos(angle));
    const auto y = std::lround(static_cast<double>(keypoint.y) + radius * std::sin(angle));
    if (x < 0 || y < 0 || x >= mask_.width() || y >= mask_.height()) continue;
    if (mask_(static_cast<int>(x), static_cast<int>(y)) == 0) return true;
  }
  return false;
}

void FeatureFrameBuilder::discard_beside_no_data(Features& features) const {
  size_t kept = 0;
  for (size_t i = 0; i < features.size(); ++i) {
    if (is_beside_no_data(features.keypoints[i])) continue;
    features.keypoints[kept] = features.keypoints[i];
    features.descriptors[kept++] = features.descriptors[i];
  }
  features.keypoints.resize(kept);
  features.descriptors.resize(kept);
}

/// σ of the depth at 1 m [m], taken to grow with the square of the depth: from second differences along rows, which
/// slanted surfaces do not have. By their median, so that edges do not count.
double FeatureFrameBuilder::depth_noise(const ImageU16& depth) {
  constexpr int kStride = 8;
  second_differences_.clear();
  for (int y = kStride / 2; y < depth.height(); y += kStride) {
    for (int x = kStride / 2; x < depth.width() - 1; x += kStride) {
      const int left = depth(x - 1, y), centre = depth(x, y), right = depth(x + 1, y);
      if (left == 0 || centre == 0 || right == 0) continue;
      const double metres = centre * sensor_.metres_per_unit;
      second_differences_.push_back(std::abs(left - 2 * centre + right) * sensor_.metres_per_unit / (metres * metres));
    }
  }
  if (second_differences_.empty()) return 0;
  constexpr double kSigmaOfMedian = 1 / 0.6745;
  return kSigmaOfMedian * lower_median(second_differences_) / std::sqrt(6.0);
}

/// Where the 3x3 patch has a hole or a step that is more than noise there is no depth.
float FeatureFrameBuilder::depth_at(const ImageU16& depth, double noise, const Keypoint& keypoint) const {
  const int x = static_cast<int>(std::lround(keypoint.x));
  const int y = static_cast<int>(std::lround(keypoint.y));
  if (x < 1 || y < 1 || x >= depth.width() - 1 || y >= depth.height() - 1) return 0.0f;
  const double centre = depth(x, y) * sensor_.metres_per_unit;
  if (centre < depth_options_.min_m || centre > depth_options_.max_m) return 0.0f;
  constexpr double kMaxSigma = 3.5 * std::numbers::sqrt2;  // of the difference of two measurements
  const double max_step = std::max(depth_options_.max_edge_ratio * centre, kMaxSigma * noise * centre * centre);
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const double neighbour = depth(x + dx, y + dy) * sensor_.metres_per_unit;
      if (!(neighbour > 0) || std::abs(neighbour - centre) > max_step) return 0.0f;
    }
  }
  return static_cast<float>(centre);
}

void FeatureFrameBuilder::add_measured_depth(const ImageU16& depth, FeatureFrame& frame) {
  const double noise = depth_noise(depth);
  for (size_t i = 0; i < frame.size(); ++i) {
    const Keypoint& keypoint = frame.features.keypoints[i];
    frame.depth[i] = depth_at(depth, noise, keypoint);
    if (frame.depth[i] > 0) frame.observations[i].u_right = keypoint.x - bf_ / static_cast<double>(frame.depth[i]);
  }
}

void FeatureFrameBuilder::add_stereo_depth(const ImageU8& right, FeatureFrame& frame) {
  right_pyramid_.build(right, orb_options_.num_levels, orb_options_.scale_factor);
  const StereoOptions& stereo = stereo_matcher_.options();
  const auto max_depth = static_cast<float>(stereo.max_depth_baselines * sensor_.baseline_m);
  const double max_disparity = bf_ / (stereo.min_depth_baselines * sensor_.baseline_m);
  stereo_matcher_.match(extractor_.pyramid(), frame.features.keypoints, right_pyramid_, max_disparity, disparity_);
  for (size_t i = 0; i < frame.size(); ++i) {
    if (std::isnan(disparity_[i])) continue;
    frame.depth[i] = static_cast<float>(bf_) / disparity_[i];
    // Far away the smallest error of the calibration outweighs what the disparity says; the depth still helps tracking.
    if (frame.depth[i] > max_depth) continue;
    frame.observations[i].u_right = static_cast<double>(frame.features.keypoints[i].x - disparity_[i]);
  }
}

std::shared_ptr<const FeatureFrame> FeatureFrameBuilder::build(FrameId id, int64_t timestamp_ns, const ImageU8& grey,
                                                               const ImageU16& depth, const ImageU8& right) {
  auto frame = std::make_shared<FeatureFrame>();
  frame->frame = id;
  frame->timestamp_ns = timestamp_ns;
  extractor_.extract(grey, frame->features);
  if (!mask_.empty()) discard_beside_no_data(frame->features);
  const size_t n = frame->size();
  frame->depth.resize(n, 0.0f);
  frame->observations.resize(n);
  for (size_t i = 0; i < n; ++i) {
    const Keypoint& keypoint = frame->features.keypoints[i];
    frame->observations[i].pixel = {keypoint.x, keypoint.y};
    frame->observations[i].inverse_variance = std::pow(orb_options_.scale_factor, -2 * keypoint.octave);
  }
  if (sensor_.metres_per_unit > 0 && !depth.empty()) add_measured_depth(depth, *frame);
  if (sensor_.baseline_m > 0 && !right.empty()) add_stereo_depth(right, *frame);
  frame->grid.build(frame->features.keypoints, grey.width(), grey.height());
  return frame;
}

}  // namespace photoslam
