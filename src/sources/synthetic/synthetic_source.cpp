// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/synthetic_source.h"

#include <cmath>
#include <numbers>

#include "base/check.h"
#include "sources/synthetic/sensor_model.h"

namespace photoslam {
namespace {

int64_t frame_time_ns(const SyntheticOptions& options, int index) {
  return static_cast<int64_t>(index * 1e9 / options.frames_per_second);
}

SE3 frame_pose(const SyntheticOptions& options, const RoomTrajectory& trajectory, int index) {
  return trajectory.world_from_camera(static_cast<double>(frame_time_ns(options, index)) * 1e-9);
}

RoomTrajectory trajectory_of(const SyntheticOptions& options) {
  return {static_cast<uint64_t>(options.seed), options.seconds_per_lap};
}

}  // namespace

SyntheticCamera::SyntheticCamera(std::shared_ptr<const SyntheticRoom> room, const SyntheticOptions& options)
    : room_(std::move(room)), options_(options), trajectory_(trajectory_of(options)) {
  PHOTOSLAM_CHECK(room_ != nullptr && options.frames_per_second > 0, "{} Hz", options.frames_per_second);
}

int64_t SyntheticCamera::timestamp_ns(int index) const { return frame_time_ns(options_, index); }

SE3 SyntheticCamera::world_from_camera(int index) const { return frame_pose(options_, trajectory_, index); }

RoomView SyntheticCamera::view(int index, Executor& executor) const {
  return room_->render(world_from_camera(index), options_.camera, executor);
}

Frame SyntheticCamera::frame(int index, Executor& executor) const {
  return sense(index, view(index, executor), kMetresPerDepthUnit);
}

Frame SyntheticCamera::sense(int index, const RoomView& ideal, double metres_per_depth_unit) const {
  const uint64_t seed = (static_cast<uint64_t>(options_.seed) << 32) + 2 * static_cast<uint64_t>(index);
  // The exposure breathes with two periods that do not divide each other.
  const double seconds = static_cast<double>(timestamp_ns(index)) * 1e-9;
  const double breath =
      0.65 * std::sin(2 * std::numbers::pi * seconds / 7.3) + 0.35 * std::sin(2 * std::numbers::pi * seconds / 2.9);
  Frame frame;
  frame.id = FrameId(index);
  frame.timestamp_ns = timestamp_ns(index);
  frame.color = expose(ideal, options_.exposure_drift * breath, options_.image_noise, seed);
  frame.depth = measure_depth(ideal, metres_per_depth_unit, options_.depth_noise, options_.depth_holes, seed + 1);
  return frame;
}

SyntheticSource::SyntheticSource(std::shared_ptr<const SyntheticRoom> room, const SyntheticOptions& options,
                                 Executor& executor)
    : camera_(std::move(room), options), executor_(executor) {
  info_.name = "synthetic room";
  info_.format = "synthetic";
  info_.sensor = SensorKind::rgbd;
  info_.camera = options.camera;
  info_.metres_per_depth_unit = SyntheticCamera::kMetresPerDepthUnit;
  info_.frames_per_second = options.frames_per_second;
  info_.num_frames = options.num_frames;
}

std::optional<Frame> SyntheticSource::next() {
  if (next_index_ >= info_.num_frames) return std::nullopt;
  return camera_.frame(next_index_++, executor_);
}

Trajectory synthetic_ground_truth(const SyntheticOptions& options) {
  const RoomTrajectory path = trajectory_of(options);
  Trajectory trajectory;
  for (int i = 0; i < options.num_frames; ++i)
    trajectory.push_back({frame_time_ns(options, i), frame_pose(options, path, i)});
  return trajectory;
}

}  // namespace photoslam
