// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/synthetic_source.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/check.h"
#include "base/random.h"
#include "sources/synthetic/sensor_model.h"

namespace photoslam {

SyntheticCamera::SyntheticCamera(std::shared_ptr<const SyntheticWorld> world, const SyntheticOptions& options,
                                 std::unique_ptr<const CameraPath> path)
    : world_(std::move(world)),
      options_(options),
      path_(path ? std::move(path) : world_->path(static_cast<uint64_t>(options.seed), options.seconds_per_lap)),
      rays_(options.camera, options.distortion),
      right_(right_camera(options)) {
  PHOTOSLAM_CHECK(options.frames_per_second > 0, "{} Hz", options.frames_per_second);
  if (options.sensor == SensorKind::stereo) right_rays_.emplace(right_.camera, right_.distortion);
}

int64_t SyntheticCamera::timestamp_ns(int index) const {
  return static_cast<int64_t>(index * 1e9 / options_.frames_per_second);
}

SE3 SyntheticCamera::world_from_camera(int index) const {
  return path_->world_from_camera(static_cast<double>(timestamp_ns(index)) * 1e-9);
}

Trajectory SyntheticCamera::ground_truth() const {
  Trajectory trajectory;
  for (int i = 0; i < options_.num_frames; ++i) trajectory.push_back({timestamp_ns(i), world_from_camera(i)});
  return trajectory;
}

SourceInfo SyntheticCamera::info() const {
  SourceInfo info;
  info.name = "synthetic world";
  info.format = "synthetic";
  info.sensor = options_.sensor;
  info.camera = options_.camera;
  info.distortion = options_.distortion;
  if (options_.sensor == SensorKind::stereo) info.right = right_;
  if (options_.sensor == SensorKind::rgbd) info.metres_per_depth_unit = kMetresPerDepthUnit;
  info.frames_per_second = options_.frames_per_second;
  info.num_frames = options_.num_frames;
  return info;
}

SceneView SyntheticCamera::film(int index, const CameraRays& rays, const SE3& left_from_camera,
                                Executor& executor) const {
  const double middle = static_cast<double>(timestamp_ns(index)) * 1e-9;
  const int height = options_.camera.height;
  const float reflections = static_cast<float>(options_.reflections);
  const auto pose = [&](int row, double moment) {
    const double delay = options_.readout_s * ((row + 0.5) / height - 0.5) + options_.shutter_s * (moment - 0.5);
    return path_->world_from_camera(std::max(0.0, middle + delay)) * left_from_camera;
  };
  if (options_.shutter_s > 0 || options_.readout_s > 0) {
    return world_->render({rays, pose, options_.shutter_s > 0, reflections}, executor);
  }
  const SE3 still = world_from_camera(index) * left_from_camera;
  return world_->render({rays, [&still](int, double) -> const SE3& { return still; }, false, reflections}, executor);
}

SceneView SyntheticCamera::view(int index, Executor& executor) const { return film(index, rays_, SE3{}, executor); }

Frame SyntheticCamera::frame(int index, Executor& executor) const {
  return sense(index, view(index, executor), kMetresPerDepthUnit, executor);
}

double SyntheticCamera::exposure_ev(int index) const {
  // The exposure breathes with two periods that do not divide each other.
  const double seconds = static_cast<double>(timestamp_ns(index)) * 1e-9;
  const double breath =
      0.65 * std::sin(2 * std::numbers::pi * seconds / 7.3) + 0.35 * std::sin(2 * std::numbers::pi * seconds / 2.9);
  // Every jump goes somewhere else: 0, up or down.
  constexpr double kSecondsPerStep = 1.5;
  const auto steps = static_cast<int64_t>(seconds / kSecondsPerStep);
  Random random(static_cast<uint64_t>(options_.seed));
  int level = 0;
  for (int64_t i = 0; i < steps; ++i) level = (level + (random.uniform() < 0.5 ? 1 : 2)) % 3;
  const double step = level == 0 ? 0 : level == 1 ? 1 : -1;
  return options_.exposure_drift * breath + options_.exposure_jumps * step;
}

Frame SyntheticCamera::sense(int index, const SceneView& ideal, double metres_per_depth_unit,
                             Executor& executor) const {
  const uint64_t seed = (static_cast<uint64_t>(options_.seed) << 32) + 2 * static_cast<uint64_t>(index);
  const double exposure = exposure_ev(index);
  Frame frame;
  frame.id = FrameId(index);
  frame.timestamp_ns = timestamp_ns(index);
  frame.color = expose(ideal, exposure, options_.image_noise, seed);
  if (options_.sensor == SensorKind::rgbd) {
    frame.depth = measure_depth(ideal, metres_per_depth_unit, options_.depth_noise, options_.depth_holes, seed + 1);
  } else if (options_.sensor == SensorKind::stereo) {
    const SceneView right = film(index, *right_rays_, right_.right_from_left.inverse(), executor);
    frame.right = expose(right, exposure, options_.image_noise, seed + 1);
  }
  return frame;
}

std::optional<Frame> SyntheticSource::next() {
  if (next_index_ >= info_.num_frames) return std::nullopt;
  return camera_.frame(next_index_++, executor_);
}

}  // namespace photoslam
