// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/executor.h"
#include "base/result.h"
#include "math/se3.h"
#include "sources/synthetic/camera_path.h"
#include "sources/synthetic/camera_rays.h"
#include "sources/synthetic/scene_view.h"

namespace photoslam {

namespace synthetic {
struct SceneModel;
}

/// How a picture is taken: a shutter that is open for a while, or reads row after row, sees the camera move.
struct Shot {
  const CameraRays& rays;
  /// Pose while row `row` is exposed; `moment` runs from 0 (shutter opens) to 1 (it closes).
  std::function<SE3(int row, double moment)> world_from_camera;
  bool moves_in_exposure = false;  ///< Whether the pose depends on the moment.
  float reflections = 1;           ///< Share of the light mirrored by glossy surfaces that reaches the camera.
};

/// A ray-traced place to film, with exact depth.
///
/// World axes: z up, metres. Immutable after construction; the result of render() depends neither on the executor nor
/// on earlier calls.
class SyntheticWorld {
 public:
  virtual ~SyntheticWorld();
  SyntheticWorld(const SyntheticWorld&) = delete;
  SyntheticWorld& operator=(const SyntheticWorld&) = delete;

  /// Safe to call from several threads with different executors.
  SceneView render(const Shot& shot, Executor& executor) const;
  /// The view of a camera at rest, without distortion.
  SceneView render(const SE3& world_from_camera, const PinholeCamera& camera, Executor& executor) const;

  /// The walk through this world. `seconds_per_lap` is the pace: 10 is leisurely, 5 twice as fast.
  virtual std::unique_ptr<const CameraPath> path(uint64_t seed, double seconds_per_lap) const = 0;

 protected:
  /// Computes the light; takes seconds.
  SyntheticWorld(synthetic::SceneModel model, SceneQuality quality, Executor& executor);

 private:
  struct State;
  std::unique_ptr<const State> state_;
};

/// A world that can be had by name.
struct WorldInfo {
  std::string name;
  std::string description;
};
std::vector<WorldInfo> synthetic_worlds();

/// Builds a world of synthetic_worlds(); takes tens of seconds at full quality.
std::shared_ptr<const SyntheticWorld> make_world(const std::string& name, uint64_t seed, Executor& executor,
                                                 SceneQuality quality = SceneQuality::full);

}  // namespace photoslam
