// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "base/executor.h"
#include "camera/pinhole.h"
#include "image/image.h"
#include "math/se3.h"

namespace photoslam {

/// What an ideal camera sees; images of the camera's size.
struct RoomView {
  ImageF radiance;  ///< [H, W, 3], linear, 1 = white at normal exposure; averaged over the pixel's area.
  ImageF depth;     ///< z coordinate [m] of the surface at the pixel centre; 0 where there is none.
  ImageF
      incidence;  ///< Cosine of the angle between the ray through the pixel centre and the surface normal, in [0, 1].
};

/// Draft: the same room with coarser textures and light, made in a tenth of the time; for tests of other things.
enum class RoomQuality { full, draft };

/// A furnished living room with ray-traced images and exact depth.
///
/// World axes: x along the room, y across, z up, in metres; the room is the box from the origin to size().
/// Immutable after construction; the result of render() depends neither on the executor nor on earlier calls.
class SyntheticRoom {
 public:
  /// Builds textures and furniture and computes the light; takes seconds.
  SyntheticRoom(uint64_t seed, Executor& executor, RoomQuality quality = RoomQuality::full);
  ~SyntheticRoom();
  SyntheticRoom(SyntheticRoom&&) noexcept;
  SyntheticRoom& operator=(SyntheticRoom&&) noexcept;

  static Vec3 size() { return {5.2, 4.2, 2.6}; }

  /// The view of a camera inside the room. Safe to call from several threads with different executors.
  RoomView render(const SE3& world_from_camera, const PinholeCamera& camera, Executor& executor) const;

 private:
  struct State;
  std::unique_ptr<const State> state_;
};

}  // namespace photoslam
