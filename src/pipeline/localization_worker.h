// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "localization/feature_frame_builder.h"
#include "localization/tracker.h"
#include "pipeline/frame_feed.h"
#include "pipeline/frame_rectifier.h"
#include "pipeline/system_options.h"

namespace photoslam {

/// A frame that became a keyframe, on its way through the mapping stages.
struct NewKeyframe {
  KeyframeProposal proposal;
  std::shared_ptr<const KeyframeImages> images;
  std::shared_ptr<const KeyframeImages> initial_images;  ///< Of proposal.initial, if there is one.
};

/// Everything that happens to a frame before mapping: rectification, features, tracking, and bookkeeping of times.
class LocalizationWorker {
 public:
  LocalizationWorker(const SystemOptions& options, const RunSettings& settings, const SourceInfo& info);

  const PinholeCamera& camera() const { return rectifier_.camera(); }
  double bf() const { return builder_.bf(); }
  /// What mapping needs to know of the rectified camera.
  MapperSensor sensor() const;

  /// Why frames are rectified on the CPU although there is a GPU; empty as long as all goes well.
  std::string gpu_failure() const { return rectifier_.gpu_failure(); }

  /// Begins lost in a map of so many keyframes, with this next_free_place().
  void resume(int num_keyframes, int next_place) { tracker_.resume(num_keyframes, next_place); }

  /// `keyframes_allowed` is false while mapping cannot take another one.
  FrameOutcome process(FedFrame fed, const std::shared_ptr<const MapSnapshot>& map, bool keyframes_allowed,
                       std::optional<NewKeyframe>& keyframe);

 private:
  bool is_mapped(const Frame& frame);

  RunSettings settings_;
  double metres_per_depth_unit_;
  FrameRectifier rectifier_;
  FeatureFrameBuilder builder_;
  Tracker tracker_;
  std::optional<int64_t> first_ns_;
  // Images of the frame that will be the first keyframe should the next frames initialise a map.
  std::shared_ptr<const KeyframeImages> initial_images_;
};

}  // namespace photoslam
