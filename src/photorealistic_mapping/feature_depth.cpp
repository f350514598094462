// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/feature_depth.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace photoslam {
namespace {

/// Depth of the picture's pixel that holds a pixel of the full image.
float picture_depth(const DepthPicture& picture, int factor, const DepthPixel& pixel) {
  if (picture.depth.empty()) return 0;
  const auto x = static_cast<int>((pixel.x + 0.5f) / static_cast<float>(factor));
  const auto y = static_cast<int>((pixel.y + 0.5f) / static_cast<float>(factor));
  const bool inside = x >= 0 && y >= 0 && x < picture.depth.width() && y < picture.depth.height();
  return inside ? picture.depth(x, y) : 0;
}

/// Squared distance and inverse depth of the nearest `count` of the known pixels.
std::vector<std::pair<float, float>> nearest_known(std::span<const DepthPixel> known, const DepthPixel& pixel,
                                                   size_t count) {
  std::vector<std::pair<float, float>> neighbours;
  for (const DepthPixel& other : known) {
    const float dx = other.x - pixel.x, dy = other.y - pixel.y;
    neighbours.emplace_back(dx * dx + dy * dy, 1 / other.depth);
  }
  const auto end = neighbours.begin() + static_cast<std::ptrdiff_t>(std::min(count, neighbours.size()));
  std::partial_sort(neighbours.begin(), end, neighbours.end());
  neighbours.erase(end, neighbours.end());
  return neighbours;
}

}  // namespace

void FeatureDepthOptions::visit(OptionVisitor& v) {
  v.value({"neighbours", "", 1, 32, "Active features whose depth a feature without one takes the mean of."},
          neighbours);
  v.value({"max_distance_px", "px", 1.0, 1000.0, "All of them must lie this near."}, max_distance_px);
  v.value({"max_spread", "", 1.0, 10.0, "Their farthest and nearest depth may differ by this factor."}, max_spread);
}

void interpolate_depth(const FeatureDepthOptions& options, std::span<DepthPixel> pixels) {
  std::vector<DepthPixel> known;
  std::ranges::copy_if(pixels, std::back_inserter(known), [](const DepthPixel& p) { return p.depth > 0; });
  const auto count = static_cast<size_t>(options.neighbours);
  if (known.size() < count) return;
  for (DepthPixel& pixel : pixels) {
    if (pixel.depth > 0) continue;
    const auto neighbours = nearest_known(known, pixel, count);
    if (std::sqrt(neighbours.back().first) > static_cast<float>(options.max_distance_px)) continue;
    const auto [low, high] = std::ranges::minmax(neighbours, {}, &std::pair<float, float>::second);
    if (high.second > static_cast<float>(options.max_spread) * low.second) continue;
    float sum = 0, weights = 0;
    for (const auto& [squared_distance, inverse_depth] : neighbours) {
      const float weight = 1 / (1 + squared_distance);
      sum += weight * inverse_depth;
      weights += weight;
    }
    pixel.depth = weights / sum;
  }
}

std::vector<DepthPixel> feature_depths(const FeatureDepthOptions& options, const MapSnapshot& map,
                                       const Keyframe& keyframe, const DepthPicture& picture, int factor) {
  std::vector<DepthPixel> pixels;
  for (size_t i = 0; i < keyframe.frame->size(); ++i) {
    const Keypoint& keypoint = keyframe.frame->features.keypoints[i];
    DepthPixel pixel{keypoint.x, keypoint.y, keyframe.frame->depth[i]};
    LandmarkId id = keyframe.landmarks[i];
    if (const LandmarkView* landmark = map.find(id)) {
      pixel.depth = static_cast<float>((keyframe.camera_from_world * landmark->position).z());
      pixel.active = true;
    } else if (!(pixel.depth > 0)) {
      pixel.depth = picture_depth(picture, factor, pixel);
    }
    pixels.push_back(pixel);
  }
  interpolate_depth(options, pixels);
  std::erase_if(pixels, [](const DepthPixel& p) { return !(p.depth > 0); });
  return pixels;
}

}  // namespace photoslam
