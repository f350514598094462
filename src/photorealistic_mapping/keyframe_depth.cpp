// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/keyframe_depth.h"

#include <algorithm>
#include <limits>

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

/// Covisible keyframes that are usable and at least and at most so far apart from this one, over its median depth.
std::vector<KeyframeId> most_covisible(const MapSnapshot& map, KeyframeId id, size_t most, double min_parallax,
                                       double max_parallax, const std::function<bool(KeyframeId)>& is_usable) {
  const KeyframeView& view = map.keyframe(id);
  std::vector<KeyframeId> chosen;
  for (const CovisibleKeyframe& candidate : view.covisible) {
    if (chosen.size() >= most) break;
    if (!is_usable(candidate.keyframe)) continue;
    const SE3 other_from_this =
        map.keyframe(candidate.keyframe).keyframe.camera_from_world * view.keyframe.camera_from_world.inverse();
    const double parallax = other_from_this.translation.norm() / std::max(view.median_depth, 1e-9);
    if (parallax >= min_parallax && parallax <= max_parallax) chosen.push_back(candidate.keyframe);
  }
  return chosen;
}

}  // namespace

std::vector<KeyframeId> sweep_neighbours(const KeyframeDepthOptions& options, const MapSnapshot& map, KeyframeId id,
                                         const std::function<bool(KeyframeId)>& has_picture) {
  return most_covisible(map, id, static_cast<size_t>(options.neighbours), options.min_parallax, options.max_parallax,
                        has_picture);
}

std::vector<KeyframeId> keyframes_to_compare(const KeyframeDepthOptions& options, const MapSnapshot& map, KeyframeId id,
                                             const std::function<bool(KeyframeId)>& has_depth) {
  constexpr size_t kMost = 4;
  return most_covisible(map, id, kMost, options.min_parallax, std::numeric_limits<double>::infinity(), has_depth);
}

}  // namespace photoslam
