// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/executor.h"
#include "io/trajectory_file.h"
#include "sources/frame.h"
#include "sources/synthetic/room.h"
#include "sources/synthetic/room_trajectory.h"
#include "sources/synthetic/synthetic_options.h"

namespace photoslam {

/// Films the synthetic room frame by frame; any frame can be made on its own, from any thread.
class SyntheticCamera {
 public:
  /// The room is shared, not copied. It should have been built with the same seed.
  SyntheticCamera(std::shared_ptr<const SyntheticRoom> room, const SyntheticOptions& options);

  const SyntheticOptions& options() const { return options_; }
  /// index / frames_per_second, rounded down to nanoseconds.
  int64_t timestamp_ns(int index) const;
  SE3 world_from_camera(int index) const;
  /// The ideal view of a frame: no noise, no holes, no exposure drift.
  RoomView view(int index, Executor& executor) const;
  /// The frame as the sensor delivers it; depth in units of kMetresPerDepthUnit.
  Frame frame(int index, Executor& executor) const;

  /// Turns an ideal view of a frame into what the sensor delivers.
  Frame sense(int index, const RoomView& ideal, double metres_per_depth_unit) const;

  static constexpr double kMetresPerDepthUnit = 1.0 / 5000.0;

 private:
  std::shared_ptr<const SyntheticRoom> room_;
  SyntheticOptions options_;
  RoomTrajectory trajectory_;
};

/// The synthetic room as a source of frames, without files.
class SyntheticSource final : public FrameSource {
 public:
  /// The executor must outlive the source; next() renders on it.
  SyntheticSource(std::shared_ptr<const SyntheticRoom> room, const SyntheticOptions& options, Executor& executor);

  const SourceInfo& info() const override { return info_; }
  std::optional<Frame> next() override;

 private:
  SyntheticCamera camera_;
  Executor& executor_;
  SourceInfo info_;
  int next_index_ = 0;
};

/// The exact poses of the frames a source with these options delivers; for evaluation only.
Trajectory synthetic_ground_truth(const SyntheticOptions& options);

}  // namespace photoslam
