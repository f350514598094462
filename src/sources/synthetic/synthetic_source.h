// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/executor.h"
#include "io/trajectory_file.h"
#include "sources/frame.h"
#include "sources/synthetic/synthetic_options.h"
#include "sources/synthetic/world.h"

namespace photoslam {

/// Films a synthetic world frame by frame; any frame can be made on its own, from any thread.
class SyntheticCamera {
 public:
  /// The world is shared, not copied. It should have been built with the same seed. Without a path the camera takes the
  /// world's own walk.
  SyntheticCamera(std::shared_ptr<const SyntheticWorld> world, const SyntheticOptions& options,
                  std::unique_ptr<const CameraPath> path = nullptr);

  const SyntheticOptions& options() const { return options_; }
  /// index / frames_per_second, rounded down to nanoseconds: the middle of the exposure of the middle row.
  int64_t timestamp_ns(int index) const;
  /// Pose of the (left) camera at timestamp_ns().
  SE3 world_from_camera(int index) const;
  Trajectory ground_truth() const;

  /// What the sensor delivers, apart from the frames themselves.
  SourceInfo info() const;

  /// The ideal view of a frame: no noise, no holes, no exposure drift. Blur and distortion are in it.
  SceneView view(int index, Executor& executor) const;
  /// The frame as the sensor delivers it; depth in units of kMetresPerDepthUnit.
  Frame frame(int index, Executor& executor) const;
  /// Turns an ideal view of a frame into what the sensor delivers; the right image of a stereo rig is rendered here.
  Frame sense(int index, const SceneView& ideal, double metres_per_depth_unit, Executor& executor) const;

  static constexpr double kMetresPerDepthUnit = 1.0 / 5000.0;

 private:
  SceneView film(int index, const CameraRays& rays, const SE3& left_from_camera, Executor& executor) const;
  double exposure_ev(int index) const;

  std::shared_ptr<const SyntheticWorld> world_;
  SyntheticOptions options_;
  std::unique_ptr<const CameraPath> path_;
  CameraRays rays_;
  RightCamera right_;
  std::optional<CameraRays> right_rays_;  ///< Stereo only.
};

/// A synthetic world as a source of frames, without files.
class SyntheticSource final : public FrameSource {
 public:
  /// The executor must outlive the source; next() renders on it.
  SyntheticSource(std::shared_ptr<const SyntheticWorld> world, const SyntheticOptions& options, Executor& executor)
      : camera_(std::move(world), options), executor_(executor), info_(camera_.info()) {}

  const SourceInfo& info() const override { return info_; }
  std::optional<Frame> next() override;

 private:
  SyntheticCamera camera_;
  Executor& executor_;
  SourceInfo info_;
  int next_index_ = 0;
};

}  // namespace photoslam
