// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/options.h"
#include "base/wholeness.h"
#include "geometry_mapping/keyframe_culling.h"
#include "localization/landmark_projection.h"
#include "localization/tracker.h"
#include "map/map.h"
#include "optimization/bundle_adjustment.h"

namespace photoslam {

struct GeometryMapperOptions {
  int local_keyframes = 12;
  int fixed_keyframes = 12;
  int fusion_keyframes = 8;
  int triangulation_keyframes = 10;
  double min_parallax_deg = 1.0;
  double fusion_radius_px = 3.0;
  double min_found_ratio = 0.25;
  double max_landmark_depth_baselines = 30.0;
  int min_landmarks = 100;
  KeyframeCullingOptions keyframe_culling;
  BundleOptions bundle;
  void visit(OptionVisitor& visitor);
};

/// What changed in the map while one keyframe was processed.
struct GeometryUpdate {
  KeyframeId keyframe;  ///< The one that was added.
  std::shared_ptr<const MapSnapshot> map;
  std::vector<KeyframeId> moved_keyframes;  ///< Poses that differ from the snapshot before, the new one included.
  BundleSummary bundle;
  int new_landmarks = 0, fused_landmarks = 0, culled_landmarks = 0, culled_keyframes = 0;
};

/// Geometry mapping: grows the map by keyframes and landmarks and keeps it consistent by local bundle adjustment over
/// covisible keyframes (paper, Sec. 3.2, Eq. 2). Synchronous and deterministic; owns the map.
class GeometryMapper {
 public:
  GeometryMapper(const GeometryMapperOptions& options, const OrbOptions& orb, const PinholeCamera& camera, double bf);
  /// Continues with a map made before.
  void set_map(Map map) { map_ = std::move(map); }
  /// Adds another's map to this one's.
  void append(const GeometryMapper& other);
  /// Writes map and state, or replaces them by those read. Throws when the map is not whole.
  void serialize(Archive& archive);
  /// False once an exception has left a change half made: such a map is neither written nor changed any more.
  bool is_whole() const { return wholeness_.is_whole(); }

  /// Adds the keyframe, culls and creates landmarks, fuses duplicates, adjusts, publishes. `interrupted` (asked between
  /// iterations, after the first two) ends the adjustment early.
  GeometryUpdate process(const KeyframeProposal& proposal, const std::function<bool()>& interrupted = {});

  /// Takes over what loop closure found: moves the map, fuses what is double, publishes.
  std::shared_ptr<const MapSnapshot> correct(const MapCorrection& correction);

  const Map& map() const { return map_; }
  std::shared_ptr<const MapSnapshot> snapshot() { return map_.snapshot(); }

 private:
  void insert(const KeyframeProposal& proposal);
  int cull_recent_landmarks(KeyframeId current);
  double max_landmark_depth(const Keyframe& keyframe) const;
  int create_measured_landmarks(KeyframeId id);
  int triangulate_landmarks(KeyframeId id);
  int triangulate_with(KeyframeId id, KeyframeId other);
  std::optional<Vec3> measured_point(const Keyframe& keyframe, int keypoint) const;
  bool fits(const Vec3& point, const Keyframe& keyframe, int keypoint) const;
  bool scales_agree(const Vec3& point, const Keyframe& a, int keypoint_a, const Keyframe& b, int keypoint_b) const;
  bool is_measured(const Landmark& landmark) const;
  int fuse_with_neighbours(KeyframeId id);
  int fuse_into(KeyframeId target, std::span<const LandmarkId> landmarks);
  BundleSummary adjust_locally(KeyframeId id, const std::function<bool()>& interrupted, std::vector<KeyframeId>& moved);
  void build_local_problem(KeyframeId id);
  void remove_outliers();
  int cull_keyframes(KeyframeId current);

  static constexpr const char* kName = "the geometric map";
  Wholeness::Change begin_change() { return {wholeness_, kName}; }

  GeometryMapperOptions options_;
  PinholeCamera camera_;
  double bf_;
  Map map_;
  Wholeness wholeness_;
  LandmarkProjector projector_;
  ProjectionMatcher matcher_;
  BundleAdjuster adjuster_;
  std::vector<LandmarkId> recent_landmarks_;

  // The local problem and what its indices stand for.
  BundleProblem problem_;
  std::vector<KeyframeId> problem_keyframes_;
  std::vector<LandmarkId> problem_landmarks_;
};

}  // namespace photoslam
