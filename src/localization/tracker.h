// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/options.h"
#include "localization/keyframe_decision.h"
#include "localization/landmark_projection.h"
#include "localization/relocalization.h"
#include "map/snapshot.h"
#include "optimization/pose_refinement.h"

namespace photoslam {

enum class TrackingState { initializing, tracking, recently_lost, lost };
const char* to_string(TrackingState state);

struct TrackerOptions {
  int min_initial_landmarks = 100;
  int min_inliers = 20;
  double last_frame_radius_px = 12.0;
  double local_map_radius_px = 4.0;
  int max_local_keyframes = 25;
  double recently_lost_s = 2.0;
  PoseRefinementOptions pose_refinement;
  KeyframeDecisionOptions keyframes;
  RelocalizationOptions relocalization;
  void visit(OptionVisitor& visitor);
};

/// How many tracked frames should have seen a landmark, and did.
struct Sighting {
  int visible = 0;
  int found = 0;
};

/// A frame that tracking wants in the map.
struct KeyframeProposal {
  KeyframeId id;
  std::shared_ptr<const FeatureFrame> frame;
  KeyframeId reference;                      ///< Invalid for the first keyframe, …
  SE3 camera_from_reference;                 ///< … whose pose this is then in the world.
  std::vector<LandmarkId> landmarks;         ///< [N] matched landmark of each keypoint.
  std::map<LandmarkId, Sighting> sightings;  ///< Since the proposal before.
};

struct TrackingResult {
  TrackingState state = TrackingState::initializing;
  std::string reason;  ///< Why there is no pose; empty while tracking.
  bool has_pose = false;
  SE3 camera_from_world;  ///< As known now.
  KeyframeId reference;   ///< The final pose is camera_from_reference * the reference's final pose.
  SE3 camera_from_reference;
  int num_features = 0;
  int num_inliers = 0;
  std::optional<KeyframeProposal> keyframe;
};

/// Localization: the pose of each frame against a snapshot of the map (paper, Sec. 3.2, Eq. 1).
///
/// Constant-velocity prediction, projection search from the last frame, then of the local map, motion-only bundle
/// adjustment after each; relocalisation when that fails. Synchronous and deterministic: results depend on the frames
/// and snapshots passed so far only.
class Tracker {
 public:
  Tracker(const TrackerOptions& options, const OrbOptions& orb, const PinholeCamera& camera, double bf);

  /// `may_become_keyframe` is false for frames that are tracked only (held out, or localisation without mapping).
  TrackingResult track(std::shared_ptr<const FeatureFrame> frame, std::shared_ptr<const MapSnapshot> map,
                       bool may_become_keyframe);

 private:
  /// Landmarks assigned to keypoints of the current frame.
  struct Matches {
    std::vector<LandmarkId> landmark;  // [N]
    std::vector<Vec3> position;        // [N] where matched
    std::vector<uint8_t> matched;      // [N] bare points count too
    explicit Matches(size_t n) : landmark(n), position(n), matched(n, 0) {}
  };

  TrackingResult initialize(const std::shared_ptr<const FeatureFrame>& frame);
  TrackingResult lost(const FeatureFrame& frame, std::string reason);
  TrackingResult tracked(const std::shared_ptr<const FeatureFrame>& frame, const SE3& camera_from_world,
                         const Matches& matches, int num_inliers, bool may_become_keyframe);

  SE3 pose_of(KeyframeId keyframe) const;
  SE3 predict_pose() const;
  int match(const FeatureFrame& frame, const MatchOptions& options, Matches& matches);
  bool track_last_frame(const FeatureFrame& frame, SE3& camera_from_world);
  int track_local_map(const FeatureFrame& frame, SE3& camera_from_world, Matches& matches);
  int refine(const FeatureFrame& frame, Matches& matches, SE3& camera_from_world) const;
  std::vector<KeyframeId> local_keyframes(const SE3& camera_from_world) const;
  void project_local_landmarks(const SE3& camera_from_world);
  double median_depth(const SE3& camera_from_world, const Matches& matches) const;
  KeyframeProposal propose(const std::shared_ptr<const FeatureFrame>& frame, const TrackingResult& result,
                           const Matches& matches);

  TrackerOptions options_;
  PinholeCamera camera_;
  double bf_;
  LandmarkProjector projector_;
  ProjectionMatcher matcher_;
  KeyframeDecision keyframe_decision_;
  std::shared_ptr<const MapSnapshot> map_;

  // The last tracked frame.
  std::shared_ptr<const FeatureFrame> last_;
  std::vector<LandmarkId> last_landmarks_;  // [N of last_]
  SE3 last_camera_from_reference_;
  SE3 motion_;  // current_from_last of the last pair of frames
  bool has_motion_ = false;
  int lost_frames_ = 0;

  // The newest proposal is the reference even before the map knows it; until then its pose follows its own reference.
  struct PendingKeyframe {
    KeyframeId reference;
    SE3 camera_from_reference;
  };
  KeyframeId reference_;
  std::map<KeyframeId, PendingKeyframe> pending_;
  int num_proposed_ = 0;
  std::map<LandmarkId, Sighting> sightings_;
};

}  // namespace photoslam
