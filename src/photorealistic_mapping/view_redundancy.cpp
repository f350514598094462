// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/view_redundancy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/check.h"

namespace photoslam {

size_t most_redundant_view(std::span<const SE3> cameras_from_world, double scene_depth) {
  PHOTOSLAM_CHECK(cameras_from_world.size() >= 2, "{} views", cameras_from_world.size());
  std::vector<Vec3> centers;
  for (const SE3& pose : cameras_from_world) centers.push_back(pose.inverse().translation);
  size_t chosen = 0;
  double smallest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < centers.size(); ++i) {
    for (size_t j = i + 1; j < centers.size(); ++j) {
      const double distance = (centers[i] - centers[j]).norm() / scene_depth;
      if (distance >= smallest) continue;
      const double cosine = std::abs(cameras_from_world[i].rotation.dot(cameras_from_world[j].rotation));
      const double difference = distance + 2 * std::acos(std::min(cosine, 1.0));
      if (difference >= smallest) continue;
      smallest = difference;
      chosen = i;
    }
  }
  return chosen;
}

}  // namespace photoslam
