// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/posed_map.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>

#include "base/check.h"
#include "math/median.h"

namespace photoslam {
namespace {

constexpr size_t kMaxCovisible = 12;

/// Fills the landmarks of a snapshot; ids are the indices of the points.
void add_landmarks(std::span<const Vec3> points, MapSnapshot& map) {
  map.num_landmarks = static_cast<int>(points.size());
  std::shared_ptr<LandmarkChunk> chunk;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto slot = static_cast<int>(i % LandmarkChunk::kSize);
    if (slot == 0) {
      chunk = std::make_shared<LandmarkChunk>();
      map.landmark_chunks.push_back(chunk);
    }
    LandmarkView view;
    view.position = points[i];
    view.alive = true;
    chunk->add(slot, view);
  }
}

/// What the camera sees of the points, as a frame of features with landmarks.
void observe(const PinholeCamera& camera, std::span<const Vec3> points, KeyframeView& view) {
  auto frame = std::make_shared<FeatureFrame>();
  std::vector<double> depths;
  for (size_t i = 0; i < points.size(); ++i) {
    const Vec3 x = view.keyframe.camera_from_world * points[i];
    if (x.z() <= 0 || !camera.contains(camera.project(x))) continue;
    const Vec2 pixel = camera.project(x);
    Keypoint keypoint;
    keypoint.x = static_cast<float>(pixel.x());
    keypoint.y = static_cast<float>(pixel.y());
    frame->features.keypoints.push_back(keypoint);
    frame->features.descriptors.emplace_back();
    frame->observations.push_back({.pixel = pixel});
    frame->depth.push_back(0);
    view.keyframe.landmarks.emplace_back(static_cast<int32_t>(i));
    depths.push_back(x.z());
  }
  view.keyframe.frame = std::move(frame);
  if (!depths.empty()) view.median_depth = lower_median(depths);
}

/// Largest distance of a camera from the mean of all.
double spread(std::span<const SE3> cameras_from_world) {
  Vec3 mean = Vec3::Zero();
  for (const SE3& pose : cameras_from_world) {
    mean += pose.inverse().translation / static_cast<double>(cameras_from_world.size());
  }
  double radius = 0;
  for (const SE3& pose : cameras_from_world) radius = std::max(radius, (pose * mean).norm());
  return radius;
}

/// Larger for cameras that are likelier to see the same.
double nearness(const SE3& a_from_world, const SE3& b_from_world, double depth) {
  const SE3 a_from_b = a_from_world * b_from_world.inverse();
  const double cosine = (a_from_b.rotation * Vec3::UnitZ()).z();
  return -(a_from_b.translation.norm() / depth + 2 * (1 - cosine));
}

std::vector<CovisibleKeyframe> covisible(std::span<const std::shared_ptr<KeyframeView>> views, size_t index) {
  const Keyframe& own = views[index]->keyframe;
  std::vector<std::pair<double, size_t>> order;
  for (size_t other = 0; other < views.size(); ++other) {
    if (other == index) continue;
    const auto& theirs = views[other]->keyframe.landmarks;
    std::vector<LandmarkId> shared;
    std::ranges::set_intersection(own.landmarks, theirs, std::back_inserter(shared));
    const double near = nearness(own.camera_from_world, views[other]->keyframe.camera_from_world,
                                 std::max(views[index]->median_depth, 1e-9));
    order.emplace_back(shared.empty() ? near : static_cast<double>(shared.size()), other);
  }
  std::ranges::sort(order, std::greater());
  order.resize(std::min(order.size(), kMaxCovisible));
  std::vector<CovisibleKeyframe> result;
  for (const auto& [score, other] : order) {
    result.push_back({KeyframeId(static_cast<int32_t>(other)), std::max(static_cast<int>(score), 0)});
  }
  return result;
}

}  // namespace

Vec3 focus_point(std::span<const SE3> cameras_from_world) {
  PHOTOSLAM_CHECK(!cameras_from_world.empty(), "no cameras");
  Mat3 sum = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (const SE3& pose : cameras_from_world) {
    const SE3 world_from_camera = pose.inverse();
    const Vec3 axis = world_from_camera.rotation * Vec3::UnitZ();
    const Mat3 across = Mat3::Identity() - axis * axis.transpose();
    sum += across;
    right += across * world_from_camera.translation;
  }
  const Eigen::LDLT<Mat3> solver(sum);
  const Vec3 before_first = cameras_from_world[0].inverse() * Vec3::UnitZ();
  if (solver.rcond() < 1e-4) return before_first;
  const Vec3 point = solver.solve(right);
  const auto is_ahead = [&](const SE3& pose) { return (pose * point).z() > 0; };
  return std::ranges::all_of(cameras_from_world, is_ahead) ? point : before_first;
}

std::shared_ptr<const MapSnapshot> posed_map(const PinholeCamera& camera, std::span<const SE3> cameras_from_world,
                                             std::span<const Vec3> points) {
  const Vec3 focus = focus_point(cameras_from_world);
  // Cameras that look outwards have what they look at nowhere near the focus, but some way off as seen from their walk.
  const double nearest = std::max(0.1 * spread(cameras_from_world), 1e-6);
  std::vector<std::shared_ptr<KeyframeView>> views;
  for (const SE3& pose : cameras_from_world) {
    auto view = std::make_shared<KeyframeView>();
    view->keyframe.id = KeyframeId(static_cast<int32_t>(views.size()));
    view->keyframe.camera_from_world = pose;
    view->median_depth = std::max((pose * focus).z(), nearest);
    observe(camera, points, *view);
    views.push_back(std::move(view));
  }
  auto map = std::make_shared<MapSnapshot>();
  add_landmarks(points, *map);
  for (size_t i = 0; i < views.size(); ++i) views[i]->covisible = covisible(views, i);
  map->keyframes.assign(views.begin(), views.end());
  return map;
}

}  // namespace photoslam
