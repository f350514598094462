// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "camera/distortion.h"
#include "camera/pinhole.h"
#include "image/image.h"

namespace photoslam {

enum class SensorKind { mono, stereo, rgbd };

/// One input frame as delivered by a source.
struct Frame {
  FrameId id;  ///< Counts up; those that a source leaves out stand for frames that its device has dropped.
  int64_t timestamp_ns = 0;
  ImageU8 color;   ///< RGB, or grey with one channel.
  ImageU16 depth;  ///< RGB-D only, registered to the colour image; metres = value * SourceInfo::metres_per_depth_unit.
  ImageU8 right;   ///< Stereo only: the other camera's image of the same moment, with as many channels as `color`.
  /// Empty when the frame is usable; otherwise why not (unreadable file, wrong size, …). Such frames are counted as
  /// lost and skipped, never fatal; their images may be empty.
  std::string defect;
};

/// The second camera of a stereo rig, as calibrated: images are not rectified yet.
struct RightCamera {
  PinholeCamera camera;
  Distortion distortion;
  SE3 right_from_left;
};

/// What a source knows before its first frame.
struct SourceInfo {
  std::string name;    ///< For people: folder and format.
  std::string format;  ///< "tum", "replica", …
  SensorKind sensor = SensorKind::rgbd;
  PinholeCamera camera;  ///< Raw intrinsics; with a distortion, those of the distorted image.
  Distortion distortion;
  bool camera_is_guess = false;      ///< Of a field of view, for want of a calibration.
  std::optional<RightCamera> right;  ///< Present exactly with stereo sensors.
  double metres_per_depth_unit = 0.0;
  double frames_per_second = 0.0;  ///< Nominal.
  int num_frames = 0;              ///< 0 when not known in advance.
  std::vector<std::string> notes;  ///< Things guessed or missing that the user should know.
};

/// A sequence of frames in time order. Not thread-safe; ground truth is not reachable through it.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  virtual const SourceInfo& info() const = 0;
  /// The next frame, or nothing at the end. Timestamps increase strictly.
  virtual std::optional<Frame> next() = 0;
};

}  // namespace photoslam
