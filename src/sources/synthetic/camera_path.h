// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/result.h"
#include "io/trajectory_file.h"
#include "math/se3.h"

namespace photoslam {

/// Where a synthetic camera is.
class CameraPath {
 public:
  virtual ~CameraPath() = default;
  /// Pose at `seconds` ≥ 0 after the start.
  virtual SE3 world_from_camera(double seconds) const = 0;
};

struct Waypoint {
  Vec3 position;
  Vec3 target;  ///< What the camera looks at.
};

/// A closed walk with a hand-held camera: endless and smooth (twice differentiable), never with quite the same shake.
/// World axes have z up; the camera is held level.
class Walk : public CameraPath {
 public:
  /// Waypoints are passed at equal intervals, `knots_per_lap` of them in a lap.
  Walk(uint64_t seed, const std::vector<Waypoint>& waypoints, double laps_per_second, int knots_per_lap);

  SE3 world_from_camera(double seconds) const override;

 private:
  double laps_per_second_;
  int knots_per_lap_;
  std::vector<double> shake_phases_;
  std::vector<Vec3> positions_;  ///< Spline coefficients, one per waypoint.
  std::vector<Vec3> targets_;
};

/// A path through given poses: linear in position, along the shortest arc in rotation; it rests at its end.
class RecordedPath final : public CameraPath {
 public:
  /// At least one pose, in order of time. The path starts at the first.
  explicit RecordedPath(Trajectory poses);

  SE3 world_from_camera(double seconds) const override;
  double seconds() const;

 private:
  Trajectory poses_;
};

/// The poses of a RecordedPath from a TUM file; an error where there are none.
Result<Trajectory> read_walk(const std::filesystem::path& tum_file);

/// Waypoints at eye height along a closed polyline whose corners are rounded, `spacing` apart [m], looking at the point
/// `ahead` metres further along.
std::vector<Waypoint> walk_along(const std::vector<Vec2>& corners, double radius, double spacing, double ahead,
                                 double eye_height);

}  // namespace photoslam
