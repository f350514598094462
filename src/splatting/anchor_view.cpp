// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/anchor_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "splatting/gaussian.h"
#include "splatting/view.h"

namespace photoslam::splatting {
namespace {

/// Variance of a pixel [px²].
constexpr float kLowPass = 0.3f;

/// Whether the intrinsics are numbers. Comparisons below would let some that are not through: what a conversion of them
/// to an integer gives differs between processors.
bool is_sane(const Camera& camera) {
  const float members[] = {camera.fx, camera.fy, camera.cx, camera.cy};
  return std::ranges::all_of(members, [](float value) { return std::abs(value) < kAbsurd; });
}

}  // namespace

AnchorView make_anchor_view(const Pose& pose, const Camera& camera, const RenderOptions& options) {
  PHOTOSLAM_CHECK(options.shrink_factor >= 1, "pictures shrunk by {}", options.shrink_factor);
  AnchorView view{};
  const double* r = pose.rotation;
  const double* t = pose.translation;
  // Centre = −R⁻¹ t by the adjugate: exact for the rotation as given, even if rounded to float.
  const double adjugate[9] = {r[4] * r[8] - r[5] * r[7], r[2] * r[7] - r[1] * r[8], r[1] * r[5] - r[2] * r[4],
                              r[5] * r[6] - r[3] * r[8], r[0] * r[8] - r[2] * r[6], r[2] * r[3] - r[0] * r[5],
                              r[3] * r[7] - r[4] * r[6], r[1] * r[6] - r[0] * r[7], r[0] * r[4] - r[1] * r[3]};
  const double det = r[0] * adjugate[0] + r[1] * adjugate[3] + r[2] * adjugate[6];
  for (int i = 0; i < 3; ++i) {
    const double* a = adjugate + 3 * i;
    const double center = -(a[0] * t[0] + a[1] * t[1] + a[2] * t[2]) / det;
    view.center[i] = static_cast<float>(center);
    view.center_low[i] = static_cast<float>(center - static_cast<double>(view.center[i]));
  }
  for (int i = 0; i < 9; ++i) view.rotation[i] = static_cast<float>(r[i]);
  view.fx = camera.fx;
  view.fy = camera.fy;
  view.cx = camera.cx;
  view.cy = camera.cy;
  const float w = static_cast<float>(camera.width), h = static_cast<float>(camera.height);
  view.min_x = (-(camera.cx + 0.5f) - 0.15f * w) / camera.fx;
  view.max_x = (w - 0.5f - camera.cx + 0.15f * w) / camera.fx;
  view.min_y = (-(camera.cy + 0.5f) - 0.15f * h) / camera.fy;
  view.max_y = (h - 0.5f - camera.cy + 0.15f * h) / camera.fy;
  view.near = is_sane(camera) ? options.near : std::numeric_limits<float>::infinity();  // nothing lies beyond it
  // The mean of s² pixels spreads their variance by that of their positions, (s² − 1) / 12 pixels of the full picture.
  const float area = static_cast<float>(options.shrink_factor * options.shrink_factor);
  view.full_low_pass = kLowPass / area;
  view.low_pass = view.full_low_pass + (1.0f - 1.0f / area) / 12.0f;
  return view;
}

}  // namespace photoslam::splatting
