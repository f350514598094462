// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/keyframe_depth.h"

#include <algorithm>

namespace photoslam {

void KeyframeDepthOptions::visit(OptionVisitor& v) {
  v.value({"enabled", "", 0, 0, "Measure depth by comparing pictures where no sensor does …"}, enabled);
  v.value({"min_unexplained", "", 0.0, 1.0,
           "… and the map leaves at least this share of the picture transparent or shows it in another colour."},
          min_unexplained);
  v.value({"spare_iterations", "", 0, 1000000,
           "… or there is time: so many training iterations have been done since depth was measured last."},
          spare_iterations);
  v.value({"neighbours", "", 0, 16, "Earlier keyframes to compare with, besides the right image of a stereo rig."},
          neighbours);
  v.value({"min_parallax", "", 0.0, 1.0, "Nearer keyframes measure too little: distance over median depth."},
          min_parallax);
  v.value({"max_parallax", "", 0.0, 10.0, "Farther keyframes look too different."}, max_parallax);
  v.group("sweep", "The plane sweep.", sweep);
}

std::optional<DepthRange> search_range(const MapSnapshot& map, const KeyframeView& view) {
  const Keyframe& keyframe = view.keyframe;
  constexpr size_t kMinLandmarks = 20;
  std::vector<double> depths;
  for (LandmarkId id : keyframe.landmarks) {
    const LandmarkView* landmark = map.find(id);
    if (landmark == nullptr) continue;
    const double depth = (keyframe.camera_from_world * landmark->position).z();
    if (depth > 0) depths.push_back(depth);
  }
  if (depths.empty() && view.median_depth > 0) return DepthRange{0.25 * view.median_depth, 6 * view.median_depth};
  if (depths.size() < kMinLandmarks) return std::nullopt;
  std::ranges::sort(depths);
  // Landmarks lie where there is texture; surfaces between them may be somewhat nearer, and much farther.
  return DepthRange{0.6 * depths[depths.size() / 50], 4.0 * depths[depths.size() - 1 - depths.size() / 50]};
}

namespace {

/// How far apart two keyframes are, over the median depth of the first.
double parallax(const MapSnapshot& map, const KeyframeView& view, KeyframeId other) {
  const SE3 other_from_this =
      map.keyframe(other).keyframe.camera_from_world * view.keyframe.camera_from_world.inverse();
  return other_from_this.translation.norm() / std::max(view.median_depth, 1e-9);
}

}  // namespace

std::vector<KeyframeId> sweep_neighbours(const KeyframeDepthOptions& options, const MapSnapshot& map, KeyframeId id,
                                         const std::function<bool(KeyframeId)>& has_picture) {
  const KeyframeView& view = map.keyframe(id);
  std::vector<KeyframeId> chosen;
  for (const CovisibleKeyframe& candidate : view.covisible) {
    if (static_cast<int>(chosen.size()) >= options.neighbours) break;
    if (!has_picture(candidate.keyframe)) continue;
    const double apart = parallax(map, view, candidate.keyframe);
    if (apart >= options.min_parallax && apart <= options.max_parallax) chosen.push_back(candidate.keyframe);
  }
  return chosen;
}

std::vector<KeyframeId> keyframes_to_compare(const KeyframeDepthOptions& options, const MapSnapshot& map, KeyframeId id,
                                             const std::function<bool(KeyframeId)>& has_depth) {
  constexpr size_t kMost = 4;
  const KeyframeView& view = map.keyframe(id);
  std::vector<KeyframeId> chosen;
  for (const CovisibleKeyframe& candidate : view.covisible) {
    if (chosen.size() == kMost) break;
    if (!has_depth(candidate.keyframe)) continue;
    if (parallax(map, view, candidate.keyframe) >= options.min_parallax) chosen.push_back(candidate.keyframe);
  }
  return chosen;
}

}  // namespace photoslam
