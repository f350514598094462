// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "features/place_index.h"
#include "geometry/similarity_ransac.h"
#include "localization/landmark_projection.h"
#include "localization/place_evidence.h"
#include "map/snapshot.h"

namespace photoslam {

struct LoopDetectorOptions {
  int max_candidates = 5;
  int min_keyframe_gap = 10;
  int min_matches = 20;
  int min_guided_matches = 40;
  double min_guided_share = 0.3;
  PlaceEvidenceOptions evidence;
  double search_radius_px = 6.0;
  double min_shift_px = 3.0;
  int neighbourhood = 10;
  int confirming_keyframes = 5;
  int min_confirmations = 2;
  SimilarityRansacOptions ransac;
  void visit(OptionVisitor& visitor);
};

/// Keyframe `now` sees again what `then` saw, and the map does not know it yet: it has the place elsewhere, or twice.
struct Loop {
  KeyframeId then, now;
  Sim3 now_from_then;                               ///< Between the camera frames, by what both see.
  std::vector<std::pair<LandmarkId, int>> matches;  ///< Landmarks around `then` and keypoints of `now`.
  std::vector<LandmarkId> landmarks;                ///< All landmarks around `then`.
  bool is_met = false;  ///< They are where they should be already: only to be recognised as the same.
};

/// Recognises places: an index of descriptors proposes keyframes that look alike, geometry decides. A loop is reported
/// only when `now` finds many of the landmarks around `then` that it should see, all over the image, and keyframes next
/// to it find many too: doors that repeat along a corridor look alike, but not with everything around them.
/// Deterministic.
class LoopDetector {
 public:
  /// `with_scale`: depth was not measured, so the map may have shrunk or grown on the way.
  LoopDetector(const LoopDetectorOptions& options, const OrbOptions& orb, const PinholeCamera& camera, double bf,
               bool with_scale);

  /// The loop that a keyframe closes, if there is one. Call once per keyframe, in order; adds it to the index.
  std::optional<Loop> detect(const MapSnapshot& map, KeyframeId now);
  /// Only adds a keyframe to the index.
  void add(const MapSnapshot& map, KeyframeId id);

 private:
  std::vector<KeyframeId> similar_places(const MapSnapshot& map, const Keyframe& now);
  std::optional<Loop> verify(const MapSnapshot& map, KeyframeId then, KeyframeId now);
  std::vector<PointMatch> match_features(const MapSnapshot& map, const Keyframe& then, const Keyframe& now) const;
  /// What a keyframe at a given pose finds of the landmarks it should see.
  struct Search {
    std::vector<std::pair<LandmarkId, int>> matches;
    bool is_same_place = false;
  };
  Search search(const MapSnapshot& map, std::span<const LandmarkId> landmarks, const SE3& camera_from_world,
                const Keyframe& keyframe, double radius_px);
  bool is_precise(const MapSnapshot& map, const Loop& loop) const;
  bool is_met(const MapSnapshot& map, const Loop& loop) const;
  bool is_news(const MapSnapshot& map, const Loop& loop) const;
  bool confirm(const MapSnapshot& map, const Loop& loop);
  std::optional<Vec3> point_in_camera(const MapSnapshot& map, const Keyframe& keyframe, size_t keypoint) const;

  LoopDetectorOptions options_;
  PinholeCamera camera_;
  double bf_;
  bool with_scale_;
  LandmarkProjector projector_;
  ProjectionMatcher matcher_;
  PlaceIndex index_;
};

/// Landmarks seen by a keyframe or by the `count` keyframes that share most with it, by id.
std::vector<LandmarkId> landmarks_around(const MapSnapshot& map, KeyframeId keyframe, int count);

}  // namespace photoslam
