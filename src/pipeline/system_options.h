// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/options.h"
#include "features/orb.h"
#include "geometry_mapping/geometry_mapper.h"
#include "localization/feature_frame_builder.h"
#include "localization/tracker.h"
#include "loop_closure/loop_closer.h"
#include "photorealistic_mapping/photorealistic_mapper.h"

namespace photoslam {

/// How the components are tied together.
struct PipelineOptions {
  int input_queue = 3;
  int keyframe_queue = 2;
  int keyframe_lag_frames = 3;
  int iterations_per_frame = 4;
  double waiting_pictures_mb = 500;
  void visit(OptionVisitor& visitor);
};

/// Every value that can be configured. One default serves all data.
struct SystemOptions {
  OrbOptions features;
  DepthOptions depth;
  StereoOptions stereo;
  TrackerOptions localization;
  GeometryMapperOptions geometry_mapping;
  LoopClosureOptions loop_closure;
  PhotorealisticOptions photorealistic_mapping;
  PipelineOptions pipeline;
  void visit(OptionVisitor& visitor);
};

}  // namespace photoslam
