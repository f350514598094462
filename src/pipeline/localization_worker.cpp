// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/localization_worker.h"

#include "base/clock.h"
#include "image/convert.h"

namespace photoslam {
namespace {

DepthSensor depth_sensor(const SourceInfo& info, double baseline_m) {
  return {.metres_per_unit = info.sensor == SensorKind::rgbd ? info.metres_per_depth_unit : 0,
          .baseline_m = baseline_m};
}

double milliseconds(SteadyTime from, SteadyTime to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

}  // namespace

LocalizationWorker::LocalizationWorker(const SystemOptions& options, const RunSettings& settings,
                                       const SourceInfo& info)
    : settings_(settings),
      metres_per_depth_unit_(info.metres_per_depth_unit),
      rectifier_(info, settings.gpu.get()),
      builder_(options.features, options.depth, options.stereo, camera(), depth_sensor(info, rectifier_.baseline_m()),
               rectifier_.mask()),
      tracker_(options.localization, options.features, camera(), builder_.bf()) {}

MapperSensor LocalizationWorker::sensor() const {
  return {camera(), metres_per_depth_unit_, rectifier_.baseline_m(), rectifier_.mask()};
}

bool LocalizationWorker::is_mapped(const Frame& frame) {
  if (!first_ns_) first_ns_ = frame.timestamp_ns;
  return 1e-9 * static_cast<double>(frame.timestamp_ns - *first_ns_) <= settings_.map_until_s;
}

FrameOutcome LocalizationWorker::process(FedFrame fed, const std::shared_ptr<const MapSnapshot>& map,
                                         bool keyframes_allowed, std::optional<NewKeyframe>& keyframe) {
  Frame& frame = fed.frame;
  FrameOutcome outcome;
  outcome.frame = frame.id;
  outcome.timestamp_ns = frame.timestamp_ns;
  outcome.held_out = settings_.hold_out > 0 && frame.id.value % settings_.hold_out == settings_.hold_out - 1;
  outcome.queue_wait_ms = milliseconds(fed.queued, std::chrono::steady_clock::now());
  if (!frame.defect.empty()) {
    outcome.state = TrackingState::lost;
    outcome.reason = frame.defect;
    return outcome;
  }

  const Stopwatch wall;
  const double cpu_before = thread_cpu_seconds();
  auto [color, depth, right] =
      rectifier_.rectify({std::move(frame.color), std::move(frame.depth), std::move(frame.right)});
  if (!right.empty()) right = to_grey(right);
  const auto features = builder_.build(frame.id, frame.timestamp_ns, to_grey(color), depth, right);
  const bool may_become_keyframe = keyframes_allowed && !outcome.held_out && is_mapped(frame);
  TrackingResult result = tracker_.track(features, map, may_become_keyframe);
  outcome.tracking_ms = wall.milliseconds();
  outcome.blocked_ms = outcome.tracking_ms - 1e3 * (thread_cpu_seconds() - cpu_before);
  if (settings_.pace == Pace::realtime) {
    outcome.latency_ms = milliseconds(fed.due, std::chrono::steady_clock::now());
  }

  outcome.state = result.state;
  outcome.reason = std::move(result.reason);
  outcome.num_features = result.num_features;
  outcome.num_inliers = result.num_inliers;
  outcome.has_pose = result.has_pose;
  outcome.online_camera_from_world = result.camera_from_world;
  outcome.reference = result.reference;
  outcome.camera_from_reference = result.camera_from_reference;
  outcome.reference_scale = result.reference_scale;
  const bool is_initial_view = tracker_.initial_view() == frame.id;
  if (!result.keyframe && !is_initial_view) return outcome;
  auto images = std::make_shared<KeyframeImages>(KeyframeImages{to_rgb(color), std::move(depth), std::move(right)});
  if (result.keyframe) {
    outcome.keyframe = result.keyframe->id;
    keyframe = NewKeyframe{std::move(*result.keyframe), images, std::move(initial_images_)};
  }
  initial_images_ = is_initial_view ? std::move(images) : nullptr;
  return outcome;
}

}  // namespace photoslam
