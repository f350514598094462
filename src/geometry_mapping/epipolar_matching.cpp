// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry_mapping/epipolar_matching.h"

#include <cmath>
#include <numbers>

#include "features/matching.h"

namespace photoslam {
namespace {

constexpr int kMaxDistance = 50;        // [bits]
constexpr double kMaxRatio = 0.9;       // best over second best
constexpr double kMaxChi2 = 3.841;      // 95 % of χ² with one degree of freedom
constexpr double kMaxRotation = 0.785;  // change of a keypoint's orientation beyond the camera's own roll [rad]

/// Pixels of the keypoints that are searched, in arrays of their own for the vectoriser.
struct Targets {
  std::vector<float> x, y, limit;  // squared distance from a line up to which it is on it [px²]
  std::vector<int> keypoint;
  std::vector<uint8_t> on_line;

  explicit Targets(const EpipolarSide& side) {
    for (size_t i = 0; i < side.frame.size(); ++i) {
      if (!side.usable[i]) continue;
      const PixelObservation& o = side.frame.observations[i];
      x.push_back(static_cast<float>(o.pixel.x()));
      y.push_back(static_cast<float>(o.pixel.y()));
      limit.push_back(static_cast<float>(kMaxChi2 / o.inverse_variance));
      keypoint.push_back(static_cast<int>(i));
    }
    on_line.resize(x.size());
  }

  /// Marks the keypoints near the line a x + b y + c = 0 with a² + b² = 1.
  void find(float a, float b, float c) {
    const float *px = x.data(), *py = y.data(), *pl = limit.data();
    uint8_t* out = on_line.data();
    for (size_t i = 0, n = x.size(); i < n; ++i) {
      const float distance = a * px[i] + b * py[i] + c;
      out[i] = distance * distance <= pl[i] ? 1 : 0;
    }
  }
};

/// F of b's pixel ᵀ F a's pixel = 0.
Mat3 fundamental(const PinholeCamera& camera, const SE3& b_from_a) {
  Mat3 inverse_intrinsics;
  inverse_intrinsics << 1 / camera.fx, 0, -camera.cx / camera.fx, 0, 1 / camera.fy, -camera.cy / camera.fy, 0, 0, 1;
  return inverse_intrinsics.transpose() * hat(b_from_a.translation) * b_from_a.matrix3() * inverse_intrinsics;
}

}  // namespace

std::vector<std::pair<int, int>> match_along_epipolar_lines(const PinholeCamera& camera, const EpipolarSide& a,
                                                            const EpipolarSide& b, const SE3& b_from_a) {
  const Mat3 f = fundamental(camera, b_from_a);
  const Mat3 rotation = b_from_a.matrix3();
  const double roll = std::atan2(rotation(1, 0) - rotation(0, 1), rotation(0, 0) + rotation(1, 1));
  Targets targets(b);
  std::vector<int> a_of_b(b.frame.size(), kNoMatch), distance_of_b(b.frame.size(), 257);
  for (size_t i = 0; i < a.frame.size(); ++i) {
    if (!a.usable[i]) continue;
    const Vec3 line = f * a.frame.observations[i].pixel.homogeneous();
    const double norm = line.head<2>().norm();
    if (!(norm > 0)) continue;
    targets.find(static_cast<float>(line.x() / norm), static_cast<float>(line.y() / norm),
                 static_cast<float>(line.z() / norm));
    const Descriptor& descriptor = a.frame.features.descriptors[i];
    const float angle = a.frame.features.keypoints[i].angle;
    int best = 257, second = 257, keypoint = kNoMatch;
    for (size_t t = 0; t < targets.on_line.size(); ++t) {
      if (!targets.on_line[t]) continue;
      const auto j = static_cast<size_t>(targets.keypoint[t]);
      const int distance = hamming_distance(descriptor, b.frame.features.descriptors[j]);
      if (distance >= second) continue;
      const auto turned = static_cast<double>(b.frame.features.keypoints[j].angle - angle);
      if (std::abs(std::remainder(turned - roll, 2 * std::numbers::pi)) > kMaxRotation) continue;
      if (distance < best) {
        second = best;
        best = distance;
        keypoint = targets.keypoint[t];
      } else {
        second = distance;
      }
    }
    if (best > kMaxDistance || best > kMaxRatio * second) continue;
    const auto j = static_cast<size_t>(keypoint);
    if (best >= distance_of_b[j]) continue;
    a_of_b[j] = static_cast<int>(i);
    distance_of_b[j] = best;
  }
  std::vector<std::pair<int, int>> pairs;
  for (size_t j = 0; j < a_of_b.size(); ++j) {
    if (a_of_b[j] != kNoMatch) pairs.emplace_back(a_of_b[j], static_cast<int>(j));
  }
  return pairs;
}

}  // namespace photoslam
