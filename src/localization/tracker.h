// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/options.h"
#include "localization/frame_alignment.h"
#include "localization/keyframe_decision.h"
#include "localization/keyframe_proposal.h"
#include "localization/mono_initializer.h"
#include "localization/pending_keyframes.h"
#include "localization/relocalization.h"
#include "map/snapshot.h"

namespace photoslam {

enum class TrackingState { initializing, tracking, recently_lost, lost };
const char* to_string(TrackingState state);

struct TrackerOptions {
  int min_initial_landmarks = 100;
  int min_inliers = 20;
  double last_frame_radius_px = 12.0;
  double local_map_radius_px = 4.0;
  int max_local_keyframes = 25;
  double min_found_share = 0.08;
  double recently_lost_s = 2.0;
  MonoInitializerOptions initialization;
  PoseRefinementOptions pose_refinement;
  KeyframeDecisionOptions keyframes;
  RelocalizationOptions relocalization;
  void visit(OptionVisitor& visitor);
};

struct TrackingResult {
  TrackingState state = TrackingState::initializing;
  std::string reason;  ///< Why there is no pose; empty while tracking.
  bool has_pose = false;
  SE3 camera_from_world;  ///< As known now.
  KeyframeId reference;   ///< The final pose is camera_from_reference * the reference's final pose.
  SE3 camera_from_reference;
  double reference_scale = 1.0;  ///< Keyframe::scale of the reference: the unit in which this is.
  int num_features = 0;
  int num_inliers = 0;
  std::optional<KeyframeProposal> keyframe;
};

/// Localization: the pose of each frame against a snapshot of the map (paper, Sec. 3.2, Eq. 1).
///
/// Constant-velocity prediction, projection search from the last frame, then of the local map, motion-only bundle
/// adjustment after each; relocalisation when that fails or finds little of what should be seen. When it fails for
/// long, a map of its own is begun, whose world lies far away from the others. Synchronous and deterministic: results
/// depend on the frames and snapshots passed so far only.
class Tracker {
 public:
  /// bf = fx * baseline [px m]; 0 for a single camera, whose unit of length is then arbitrary.
  Tracker(const TrackerOptions& options, const OrbOptions& orb, const PinholeCamera& camera, double bf);

  /// Begins lost in a map of so many keyframes that was made before, with this next_free_place().
  void resume(int num_keyframes, int next_place);

  /// `may_become_keyframe` is false for frames that are tracked only (held out, or localisation without mapping).
  TrackingResult track(const std::shared_ptr<const FeatureFrame>& frame, std::shared_ptr<const MapSnapshot> map,
                       bool may_become_keyframe);

  /// The frame whose images are needed should the next ones initialise a map; invalid when there is none.
  FrameId initial_view() const { return initializer_.first_view(); }

 private:
  using Points = std::vector<PendingKeyframes::Point>;

  /// A pose, and what the frame shows of the map there.
  struct Located {
    SE3 camera_from_world;
    KeyframeId reference;
    FrameMatches matches;
    int num_inliers = 0;
    double share = 1;  ///< Of the points that could be found, those that were; 1 where there are none.
    std::vector<LandmarkId> visible;
    bool is_relocalized = false;
  };

  TrackingResult start_map(const std::shared_ptr<const FeatureFrame>& frame);
  TrackingResult lost(const FeatureFrame& frame, std::string reason);
  TrackingResult tracked(const std::shared_ptr<const FeatureFrame>& frame, Located located, bool may_become_keyframe);

  SE3 pose_of(KeyframeId keyframe) const { return pending_.camera_from_world(keyframe, map_.get()); }
  double scale_of(KeyframeId keyframe) const { return pending_.scale(keyframe, map_.get()); }
  double growth_since_last() const { return scale_of(reference_) / last_reference_scale_; }
  SE3 last_pose() const;
  void resolve_last_matches();
  bool track_last_frame(const FeatureFrame& frame, SE3& camera_from_world);
  Located track_local_map(const FeatureFrame& frame, const SE3& camera_from_world, KeyframeId reference);
  bool is_certain(const Located& located) const;
  std::optional<Located> locate(const FeatureFrame& frame);
  void count_sightings(const Located& located);
  std::vector<KeyframeId> local_keyframes(const SE3& camera_from_world) const;
  KeyframeProposal propose(const std::shared_ptr<const FeatureFrame>& frame, const TrackingResult& result,
                           const FrameMatches& matches);

  TrackerOptions options_;
  PinholeCamera camera_;
  double bf_;
  FrameAlignment alignment_;
  Relocalizer relocalizer_;
  MonoInitializer initializer_;
  KeyframeDecision keyframe_decision_;
  std::shared_ptr<const MapSnapshot> map_;

  // The last tracked frame.
  std::shared_ptr<const FeatureFrame> last_;
  FrameMatches last_matches_;
  SE3 last_camera_from_reference_;
  double last_reference_scale_ = 1.0;  // the unit of this, and of the velocity
  std::optional<Vec6> velocity_;       // twist per nanosecond between the last two frames
  int lost_frames_ = 0;

  KeyframeId reference_;  // the newest proposal, even before the map knows it
  PendingKeyframes pending_;
  int num_proposed_ = 0;
  int next_place_ = 0;  // of the next map [kMapSpacing]
  std::map<LandmarkId, Sighting> sightings_;
};

}  // namespace photoslam
