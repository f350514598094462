// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "base/ids.h"
#include "camera/pixel_observation.h"
#include "features/matching.h"
#include "features/orb.h"
#include "image/image.h"
#include "math/se3.h"

namespace photoslam {

/// Features of one image with their measured depths: what tracking and mapping know of a frame, never changed again.
struct FeatureFrame {
  FrameId frame;
  int64_t timestamp_ns = 0;
  Features features;
  std::vector<float> depth;                    ///< [N] metres; 0 where nothing was measured.
  std::vector<PixelObservation> observations;  ///< [N] pixel, u_right and σ of each keypoint.
  KeypointGrid grid;
  size_t size() const { return features.size(); }
};

/// Undistorted input images of a keyframe, kept for photorealistic mapping.
struct KeyframeImages {
  ImageU8 color;   ///< RGB.
  ImageU16 depth;  ///< Empty without a depth sensor.
  ImageU8 right;   ///< Grey, from the right camera of a rectified stereo pair; else empty.
  /// 0 where this picture has no data, if it differs from the others of the sensor; sessions cannot keep it.
  ImageU8 mask = {};
};

/// A selected frame of the map.
struct Keyframe {
  KeyframeId id;
  std::shared_ptr<const FeatureFrame> frame;
  SE3 camera_from_world;
  std::vector<LandmarkId> landmarks;  ///< [N] landmark seen by each keypoint; invalid where there is none.
  KeyframeId parent;    ///< Spanning tree: a keyframe that it shared landmarks with; none for the root of a map.
  double scale = 1.0;   ///< Present unit of the camera frame in units of the one at birth: what was measured then grows
                        ///< by this factor. Only loops of a monocular camera change it.
  bool culled = false;  ///< It lost its features and landmarks, and follows its parent.
  SE3 from_parent;      ///< Of a culled keyframe: camera_from_parent, fixed in units of the present.
};

}  // namespace photoslam
