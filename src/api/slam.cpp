// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photoslam/slam.h"

#include <algorithm>
#include <limits>
#include <stop_token>
#include <utility>

#include "api/splat_map_state.h"
#include "photorealistic_mapping/world_export.h"
#include "pipeline/config.h"
#include "pipeline/frame_rectifier.h"
#include "pipeline/system.h"
#include "sources/open_source.h"
#include "splatting/gpu.h"

namespace photoslam {
namespace {

Distortion to_distortion(const std::array<double, 5>& d) { return {d[0], d[1], d[2], d[3], d[4]}; }

/// Frames from the caller as a source of the system.
class CallerSource final : public FrameSource {
 public:
  CallerSource(const CameraModel& camera, double metres_per_depth_unit, const RgbdInput& next_frame)
      : next_frame_(next_frame) {
    info_.name = "frames of the caller";
    info_.format = "memory";
    info_.camera = {camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy};
    info_.distortion = to_distortion(camera.distortion);
    info_.metres_per_depth_unit = metres_per_depth_unit;
  }

  const SourceInfo& info() const override { return info_; }

  std::optional<Frame> next() override {
    const std::optional<RgbdFrame> given = next_frame_();
    if (!given) return std::nullopt;
    Frame frame;
    frame.id = FrameId(next_id_++);
    const size_t pixels = static_cast<size_t>(info_.camera.width) * static_cast<size_t>(info_.camera.height);
    if (given->timestamp_ns <= last_timestamp_ns_) {
      frame.defect = "timestamp not later than that of the frame before";
    } else if (given->rgb.size() != 3 * pixels || given->depth.size() != pixels) {
      frame.defect = "not the size of the camera";
    }
    last_timestamp_ns_ = std::max(given->timestamp_ns, last_timestamp_ns_ + 1);
    frame.timestamp_ns = last_timestamp_ns_;
    if (!frame.defect.empty()) return frame;
    frame.color = ImageU8(info_.camera.width, info_.camera.height, 3);
    frame.depth = ImageU16(info_.camera.width, info_.camera.height);
    std::copy(given->rgb.begin(), given->rgb.end(), frame.color.values().begin());
    std::copy(given->depth.begin(), given->depth.end(), frame.depth.values().begin());
    return frame;
  }

 private:
  const RgbdInput& next_frame_;
  SourceInfo info_;
  int32_t next_id_ = 0;
  int64_t last_timestamp_ns_ = std::numeric_limits<int64_t>::min();
};

std::shared_ptr<splatting::Gpu> open_gpu(const SlamSettings& settings) {
  const auto backend = settings.backend == Backend::cpu    ? splatting::Backend::cpu
                       : settings.backend == Backend::cuda ? splatting::Backend::cuda
                                                           : splatting::Backend::automatic;
  std::string note;
  const auto gpu = splatting::choose_backend(backend, settings.gpu_memory_mb, note);
  if (!gpu) throw Failure(gpu.error().message);
  return *gpu;
}

RunSettings to_run_settings(const SlamSettings& settings) {
  if (settings.deterministic && settings.refine_seconds > 0)
    throw Failure("refine_seconds depends on the clock; deterministic runs take refine_iterations");
  RunSettings run;
  run.pace = settings.realtime && !settings.deterministic ? Pace::realtime : Pace::asap;
  run.deterministic = settings.deterministic;
  run.seed = settings.seed;
  run.threads = settings.threads;
  run.refine_seconds = settings.refine_seconds;
  run.refine_iterations = settings.refine_iterations;
  run.gpu = open_gpu(settings);
  return run;
}

std::vector<CameraPose> to_poses(const Trajectory& trajectory) {
  std::vector<CameraPose> poses;
  for (const StampedPose& stamped : trajectory) {
    const Quat& q = stamped.world_from_camera.rotation;
    const Vec3& t = stamped.world_from_camera.translation;
    poses.push_back({stamped.timestamp_ns, {t.x(), t.y(), t.z()}, {q.w(), q.x(), q.y(), q.z()}});
  }
  return poses;
}

SlamResult map_source(FrameSource& source, const SlamSettings& settings, const KeepGoing& keep_going) {
  SystemOptions options;
  for (const std::string& setting : settings.configuration) {
    if (const Status status = apply_setting(setting, options); !status) throw Failure(status.error().message);
  }
  std::stop_source stop;
  const auto on_progress = [&](const Progress& progress) {
    if (keep_going && !keep_going(progress.frames)) stop.request_stop();
  };
  const SourceInfo info = source.info();
  const RunSettings run_settings = to_run_settings(settings);
  const RunOutcome run = run_slam(options, run_settings, source, stop.get_token(), on_progress);

  SlamResult result;
  result.frames = static_cast<int>(run.frames.size());
  for (const FrameOutcome& frame : run.frames) {
    result.tracked += frame.has_pose ? 1 : 0;
    result.dropped += frame.dropped ? 1 : 0;
  }
  result.trajectory = to_poses(final_trajectory(run));
  result.keyframes = to_poses(keyframe_trajectory(run));
  const PinholeCamera camera = FrameRectifier(info).camera();
  result.camera = {camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, {}};
  result.map =
      SplatMapAccess::make(to_world(run.final.gaussians, run.final.anchors_from_world, connected_keyframes(run)));
  if (run_settings.gpu) {
    result.gpu = run_settings.gpu->name();
    result.gpu_failure = run_settings.gpu->failure();
    if (result.gpu_failure.empty() && run.gpu) result.gpu_failure = run.gpu->undistortion_failure;
  }
  result.failure = run.failure;
  return result;
}

}  // namespace

SlamResult map_frames(const CameraModel& camera, double metres_per_depth_unit, const RgbdInput& next_frame,
                      const SlamSettings& settings, const KeepGoing& keep_going) {
  if (camera.width <= 0 || camera.height <= 0 || !(camera.fx > 0) || !(camera.fy > 0) || !(metres_per_depth_unit > 0))
    throw Failure("map_frames: the camera needs a size, focal lengths and a depth unit");
  CallerSource source(camera, metres_per_depth_unit, next_frame);
  return map_source(source, settings, keep_going);
}

SlamResult map_dataset(const std::filesystem::path& folder, const SlamSettings& settings, const KeepGoing& keep_going) {
  auto source = open_source(folder);
  if (!source) throw Failure(source.error().message);
  return map_source(**source, settings, keep_going);
}

}  // namespace photoslam
