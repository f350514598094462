// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <vector>

#include "loop_closure/loop_detector.h"
#include "map/map_correction.h"
#include "optimization/bundle_adjustment.h"
#include "optimization/pose_graph.h"

namespace photoslam {

struct LoopClosureOptions {
  bool enabled = true;
  int essential_landmarks = 60;
  LoopDetectorOptions detection;
  PoseGraphOptions pose_graph;
  BundleOptions bundle{.max_iterations = 50, .relative_cost_tolerance = 1e-6};
  void visit(OptionVisitor& visitor);
};

/// Loop closure: watches the map, and says how it must change when the camera comes back to a known place. Reads
/// snapshots and answers with corrections, so that it can run beside tracking and mapping. Synchronous, deterministic.
class LoopCloser {
 public:
  /// bf = fx * baseline [px m], 0 where depth is not measured: then loops correct the scale too.
  LoopCloser(const LoopClosureOptions& options, const OrbOptions& orb, const PinholeCamera& camera, double bf);

  /// Looks at keyframes it has not seen yet, until one closes a loop; when the map has taken over a loop, adjusts
  /// everything. The caller applies the correction and calls again with the corrected map, until nothing comes.
  /// Nothing comes either while an earlier correction is not in the map yet.
  std::optional<MapCorrection> process(const MapSnapshot& map, const std::function<bool()>& interrupted = {});

  /// Begins with a map made before. The first `num_settled` of its keyframes are not looked at again.
  void resume(const MapSnapshot& map, int num_settled);

  /// Keyframes that have been looked at, and whatever came of them is in the map. From any thread.
  int num_settled() const { return num_settled_; }
  int num_closed() const { return num_closed_; }
  /// Times that tracking itself found back to an old part of the map.
  int num_reconnected() const { return num_reconnected_; }
  const std::vector<Loop>& loops() const { return loops_; }

 private:
  void count_reconnection(const MapSnapshot& map, KeyframeId id);

  LoopClosureOptions options_;
  PinholeCamera camera_;
  double bf_;
  LoopDetector detector_;
  KeyframeId next_{0};
  std::atomic<int> num_settled_{0};
  int num_issued_ = 0;  // corrections
  int num_closed_ = 0;
  int num_reconnected_ = 0;
  bool in_old_place_ = false;
  std::vector<Loop> loops_;
};

}  // namespace photoslam
