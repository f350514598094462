// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/system_options.h"

namespace photoslam {

void PipelineOptions::visit(OptionVisitor& v) {
  v.value(
      {"input_queue", "frames", 1, 1000, "Frames that may wait for tracking; at real-time pace the oldest is dropped."},
      input_queue);
  v.value({"keyframe_queue", "keyframes", 1, 100, "At real-time pace no keyframe is made while so many wait."},
          keyframe_queue);
  v.value({"keyframe_lag_frames", "frames", 1, 100,
           "By logical time, tracking sees a keyframe's effect on the map so many frames later."},
          keyframe_lag_frames);
  v.value({"iterations_per_frame", "iterations", 0, 1000, "By logical time, training iterations for each input frame."},
          iterations_per_frame);
  v.value({"waiting_pictures_mb", "MB", 1.0, 1e6,
           "At real-time pace, when pictures of more keyframes wait for photorealistic mapping, more and more of them, "
           "evenly spread, are mapped without."},
          waiting_pictures_mb);
}

void SystemOptions::visit(OptionVisitor& v) {
  v.group("features", "ORB features.", features);
  v.group("depth", "Measured depth, as tracking uses it.", depth);
  v.group("stereo", "Depth from a second camera.", stereo);
  v.group("localization", "Camera tracking.", localization);
  v.group("geometry_mapping", "Landmarks, keyframes and local bundle adjustment.", geometry_mapping);
  v.group("loop_closure", "Places visited again, and the correction of the drift since.", loop_closure);
  v.group("photorealistic_mapping", "The gaussians.", photorealistic_mapping);
  v.group("pipeline", "How the components work together.", pipeline);
}

}  // namespace photoslam
