// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/testing/scenes.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace photoslam::splatting::testing {

void random_rotation(Random& random, double angle, double* r) {
  double q[4] = {std::cos(angle / 2), random.normal(), random.normal(), random.normal()};
  const double n = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int i = 1; i < 4; ++i) q[i] *= std::sin(angle / 2) / n;
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double m[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                       2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                       2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  std::copy_n(m, 9, r);
}

void Scene::build(uint64_t seed) {
  Random random(seed);
  view.camera = {width,
                 height,
                 0.9f * static_cast<float>(std::max(width, height)),
                 0.95f * static_cast<float>(std::max(width, height)),
                 0.43f * static_cast<float>(width),
                 0.56f * static_cast<float>(height)};  // off-centre
  options.sh_degree = sh_degree;
  options.shrink_factor = shrink_factor;
  for (float& b : options.background) b = static_cast<float>(random.uniform());
  const Camera& c = view.camera;
  reference_view = {.width = width,
                    .height = height,
                    .fx = c.fx,
                    .fy = c.fy,
                    .cx = c.cx,
                    .cy = c.cy,
                    .near = options.near,
                    .shrink_factor = shrink_factor,
                    .background = {options.background[0], options.background[1], options.background[2]},
                    .sh_degree = sh_degree,
                    .camera_from_anchor = {}};
  poses.resize(static_cast<size_t>(anchors));
  for (Pose& pose : poses) {
    random_rotation(random, random.uniform(0.2, 1.5), pose.rotation);
    for (double& t : pose.translation) t = random.uniform(-0.5, 0.5);
    pose.translation[0] += distance;
    reference::Pose reference_pose;
    std::copy_n(pose.rotation, 9, reference_pose.rotation.begin());
    std::copy_n(pose.translation, 3, reference_pose.translation.begin());
    reference_view.camera_from_anchor.push_back(reference_pose);
    model.add_anchor();
  }
  view.camera_from_anchor = poses;
  for (int i = 0; i < count; ++i) {
    const int anchor = i % anchors;
    const Pose& pose = poses[static_cast<size_t>(anchor)];
    const double z = random.uniform(depth_min, depth_max);
    const double px = c.cx + (random.uniform() - 0.5) * spread * width + (0.5 * width - c.cx);
    const double py = c.cy + (random.uniform() - 0.5) * spread * height + (0.5 * height - c.cy);
    const double camera[3] = {(px - c.cx) / c.fx * z, (py - c.cy) / c.fy * z, z};
    Gaussian g;
    for (int k = 0; k < 3; ++k) {
      double value = 0;
      for (int m = 0; m < 3; ++m) value += pose.rotation[3 * m + k] * (camera[m] - pose.translation[m]);
      g.mean[k] = static_cast<float>(value);
    }
    for (float& q : g.rotation) q = static_cast<float>(random.normal());
    for (float& s : g.log_scale) s = static_cast<float>(random.uniform(log_scale_min, log_scale_max));
    g.log_scale[0] += static_cast<float>(needle);
    g.log_scale[1] -= static_cast<float>(needle);
    g.opacity_logit = static_cast<float>(random.uniform(logit_min, logit_max));
    for (auto& coefficient : g.sh)
      for (float& value : coefficient) value = static_cast<float>(0.3 * random.normal());
    reference::Gaussian r;
    r.anchor = anchor;
    double* p = r.parameters.data();
    for (float v : g.mean) *p++ = v;
    for (float v : g.rotation) *p++ = v;
    for (float v : g.log_scale) *p++ = v;
    *p++ = g.opacity_logit;
    for (const auto& coefficient : g.sh)
      for (float v : coefficient) *p++ = v;
    reference_gaussians.push_back(r);
    indices.push_back(model.add(anchor, {&g, 1}).front());
  }
}

std::vector<Scene> hard_scenes() {
  std::vector<Scene> scenes;
  const auto scene = [&](const char* name) -> Scene& {
    scenes.emplace_back();
    scenes.back().name = name;
    return scenes.back();
  };
  scene("plain");
  Scene& behind = scene("behind_and_near");
  behind.depth_min = -2;
  behind.depth_max = 2;
  behind.log_scale_max = -2;
  scene("border").spread = 2.2;
  Scene& huge = scene("huge");
  huge.log_scale_min = -1;
  huge.log_scale_max = 3.5;
  huge.logit_max = 0;
  huge.count = 120;
  huge.image_tolerance = 2e-5;
  Scene& tiny = scene("tiny");
  tiny.log_scale_min = -12;
  tiny.log_scale_max = -6;
  tiny.image_tolerance = 2e-5;
  scene("shrunk").shrink_factor = 2;
  Scene& shrunk = scene("shrunk_to_a_quarter");
  shrunk.shrink_factor = 4;
  shrunk.log_scale_min = -7;
  shrunk.log_scale_max = -4;
  shrunk.image_tolerance = 2e-5;
  Scene& needles = scene("needles");
  needles.needle = 2.5;
  needles.log_scale_min = -4;
  needles.log_scale_max = -2.5;
  needles.image_tolerance = 2e-5;
  Scene& transparent = scene("transparent");
  transparent.logit_min = -6.2;
  transparent.logit_max = -3;
  Scene& opaque = scene("opaque");
  opaque.logit_min = 4;
  opaque.logit_max = 12;
  Scene& dense = scene("dense");
  dense.count = 3000;
  dense.width = 70;
  dense.height = 45;
  dense.max_ambiguous = 0.3;
  Scene& far = scene("far");
  far.distance = 60;
  far.image_tolerance = 5e-5;
  far.gradient_tolerance = 2e-4;
  Scene& anchors = scene("many_anchors");
  anchors.anchors = 7;
  Scene& low_degree = scene("degree_1");
  low_degree.sh_degree = 1;
  low_degree.width = 33;
  low_degree.height = 65;
  Scene& flat = scene("degree_0");
  flat.sh_degree = 0;
  flat.width = 32;
  flat.height = 32;
  Scene& pixel = scene("one_pixel");
  pixel.width = pixel.height = 1;
  pixel.count = 20;
  pixel.max_ambiguous = 1;
  return scenes;
}

}  // namespace photoslam::splatting::testing
