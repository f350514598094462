// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "base/random.h"
#include "sources/frame.h"

namespace photoslam::testing {

/// A small camera that walks past the corner of a room with painted walls: exact images, depths and poses, made in
/// milliseconds. The stereo cameras have lenses and squint at each other.
class CornerSource final : public FrameSource {
 public:
  /// A lens that sees more than the wall in front, which two motions would explain to a single camera [image widths].
  static constexpr double kWide = 0.45;

  explicit CornerSource(int num_frames, int width = 240, int height = 180, SensorKind sensor = SensorKind::rgbd,
                        double focal = 0.85)
      : num_frames_(num_frames) {
    info_.name = "painted corner";
    info_.format = "test";
    info_.camera = {width, height, focal * width, focal * width, 0.51 * width, 0.49 * height};
    info_.sensor = sensor;
    if (sensor == SensorKind::rgbd) info_.metres_per_depth_unit = kMetresPerUnit;
    if (sensor == SensorKind::stereo) {
      info_.distortion = {.k1 = -0.2, .k2 = 0.05, .p1 = 1e-3};
      info_.right = RightCamera{
          info_.camera, {.k1 = -0.21, .k2 = 0.04}, SE3(so3_exp(Vec3(0.01, -0.02, 0.015)), Vec3(-0.1, 0.002, 0.001))};
      info_.right->camera.fx += 3;
    }
    info_.frames_per_second = 30;
    info_.num_frames = num_frames;
    Random random(7);
    for (int i = 0; i < kTexture * kTexture * 3; ++i) texels_.push_back(static_cast<float>(random.uniform()));
  }

  const SourceInfo& info() const override { return info_; }

  std::optional<Frame> next() override {
    if (next_ == num_frames_) return std::nullopt;
    if (next_ == throw_at) throw std::runtime_error("the cable was pulled");
    Frame frame = draw(next_);
    if (next_ == defect_at) {
      frame.color = {};
      frame.defect = "unreadable";
    }
    ++next_;
    if (next_ > gap_at && gap_at >= 0) frame.id.value += gap;
    return frame;
  }

  static SE3 camera_from_world(int index) {
    const double s = index / 30.0;
    return SE3(so3_exp(Vec3(0.03 * std::sin(2 * s), 0.15 * std::sin(s), 0)),
               Vec3(0.3 * std::sin(0.8 * s), 0.05 * std::sin(1.5 * s), 0.2 * s))
        .inverse();
  }

  int throw_at = -1;   ///< next() throws instead of delivering this frame.
  int defect_at = -1;  ///< This frame cannot be read.
  int gap_at = -1;     ///< Before this frame, so many have been dropped.
  int gap = 0;
  int start_at = 0;  ///< The walk begins where it would be after so many frames.

 private:
  static constexpr int kTexture = 64;
  static constexpr double kMetresPerUnit = 0.0002;

  float texel(int x, int y, int c) const {
    const auto wrap = [](int i) { return ((i % kTexture) + kTexture) % kTexture; };
    return texels_[static_cast<size_t>((wrap(y) * kTexture + wrap(x)) * 3 + c)];
  }

  /// Smooth value noise on a wall with coordinates in metres; two octaves.
  float paint(double u, double v, int c) const {
    float value = 0;
    for (const auto& [frequency, weight] : {std::pair{9.0, 0.65f}, {27.0, 0.35f}}) {
      const double x = u * frequency, y = v * frequency;
      const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
      const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
      value += weight * ((1 - fy) * ((1 - fx) * texel(x0, y0, c) + fx * texel(x0 + 1, y0, c)) +
                         fy * ((1 - fx) * texel(x0, y0 + 1, c) + fx * texel(x0 + 1, y0 + 1, c)));
    }
    return value;
  }

  Frame draw(int index) const {
    const SE3 camera_from_world = CornerSource::camera_from_world(start_at + index);
    Frame frame;
    frame.id = FrameId(index);
    frame.timestamp_ns = static_cast<int64_t>(index) * 1'000'000'000 / 30;
    frame.color = paint_view(info_.camera, info_.distortion, camera_from_world,
                             info_.sensor == SensorKind::rgbd ? &frame.depth : nullptr);
    if (info_.right) {
      frame.right = paint_view(info_.right->camera, info_.right->distortion,
                               info_.right->right_from_left * camera_from_world, nullptr);
    }
    return frame;
  }

  ImageU8 paint_view(const PinholeCamera& camera, const Distortion& lens, const SE3& camera_from_world,
                     ImageU16* depth) const {
    const SE3 world_from_camera = camera_from_world.inverse();
    ImageU8 image(camera.width, camera.height, 3);
    if (depth != nullptr) *depth = ImageU16(camera.width, camera.height);
    // Walls: z = 3, x = 1.5, x = −1.5; floor and ceiling y = ±1.2.
    const struct {
      int axis;
      double at;
    } walls[] = {{2, 3.0}, {0, 1.5}, {0, -1.5}, {1, 1.2}, {1, -1.2}};
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Vec2 bent = camera.unproject(Vec2(x, y), 1.0).head<2>();
        const Vec2 straight = undistort(lens, bent).value();
        const Vec3 ray = world_from_camera.rotation * Vec3(straight.x(), straight.y(), 1.0);
        double z = std::numeric_limits<double>::max();
        int axis = 0;
        for (const auto& wall : walls) {
          const double t = (wall.at - world_from_camera.translation[wall.axis]) / ray[wall.axis];
          if (t > 0 && t < z) {
            z = t;
            axis = wall.axis;
          }
        }
        const Vec3 hit = world_from_camera.translation + z * ray;
        for (int c = 0; c < 3; ++c) {
          const float value = paint(hit[(axis + 1) % 3] + 0.37 * axis, hit[(axis + 2) % 3], c);
          image(x, y, c) = static_cast<uint8_t>(std::lround(255.0f * value));
        }
        if (depth != nullptr) (*depth)(x, y) = static_cast<uint16_t>(std::lround(z / kMetresPerUnit));
      }
    }
    return image;
  }

  int num_frames_;
  int next_ = 0;
  SourceInfo info_;
  std::vector<float> texels_;
};

}  // namespace photoslam::testing
