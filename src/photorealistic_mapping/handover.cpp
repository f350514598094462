// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/handover.h"

#include <cmath>
#include <map>
#include <utility>

#include "map/map_spacing.h"
#include "photorealistic_mapping/view_geometry.h"
#include "photorealistic_mapping/world_export.h"

namespace photoslam {
namespace {

Vec3 mean_of(const splatting::Gaussian& g) {
  return {static_cast<double>(g.mean[0]), static_cast<double>(g.mean[1]), static_cast<double>(g.mean[2])};
}

/// The way from one anchor's frame to another's, in present units.
struct Passage {
  explicit Passage(const SE3& to_from_from) : pose(to_from_from), rotation(to_from_from.matrix3()) {}
  SE3 pose;
  ShRotation rotation;
};

struct Arrival {
  int anchor;
  splatting::Gaussian gaussian;
  uint32_t tag, birth;
};

/// The leaving ones go from where they were.
void move(std::span<const uint8_t> leaves, std::span<const Arrival> arrivals, splatting::GaussianModel& model) {
  model.remove(leaves);
  for (const Arrival& arrival : arrivals) model.add(arrival.anchor, {&arrival.gaussian, 1}, arrival.tag, arrival.birth);
}

}  // namespace

void LastViewers::show(int keyframe, const PinholeCamera& camera, std::span<const splatting::Pose> camera_from_anchor,
                       const splatting::RenderResult& render) {
  constexpr double kMinAlpha = 0.3, kBehind = 1.05;  // of the depth that is rendered
  model_.for_each([&](size_t i) {
    const Vec3 p = in_camera(camera_from_anchor[static_cast<size_t>(model_.anchor(i))], model_.get(i));
    constexpr double kElsewhere = kMapSpacing / 2;  // beyond is another map, whatever the picture shows of it
    if (!(p.z() > 0 && p.z() < kElsewhere)) return;
    const Vec2 pixel = camera.project(p);
    const bool inside =
        pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < camera.width - 0.5 && pixel.y() < camera.height - 0.5;
    if (!inside) return;
    const auto at = static_cast<size_t>(std::lround(pixel.y())) * static_cast<size_t>(camera.width) +
                    static_cast<size_t>(std::lround(pixel.x()));
    const auto alpha = static_cast<double>(render.alpha[at]);
    const bool shown = alpha > kMinAlpha && alpha * p.z() < kBehind * static_cast<double>(render.depth[at]);
    if (shown) viewers_[i] = keyframe;
  });
}

size_t hand_over(double min_shift_px, const PinholeCamera& camera, std::span<const Sim3> before,
                 std::span<const Sim3> after, const LastViewers& viewers, splatting::GaussianModel& model) {
  std::map<std::pair<size_t, size_t>, Passage> passages;
  std::vector<Arrival> arrivals;
  std::vector<uint8_t> leaves(model.index_end(), 0);
  model.for_each([&](size_t i) {
    if (viewers[i] == LastViewers::kNobody || viewers[i] == model.anchor(i)) return;
    const auto from = static_cast<size_t>(model.anchor(i)), to = static_cast<size_t>(viewers[i]);
    const splatting::Gaussian g = model.get(i);
    const Vec3 in_world = before[from].rigid().inverse() * mean_of(g);
    const Vec3 was = before[to] * in_world;
    const Vec3 would_be = after[to] * (after[from].inverse() * (before[from] * in_world));
    const bool stays =
        was.z() > 0 && would_be.z() > 0 && (camera.project(would_be) - camera.project(was)).norm() <= min_shift_px;
    if (stays) return;
    const auto [passage, is_new] =
        passages.try_emplace({from, to}, before[to].rigid() * before[from].rigid().inverse());
    arrivals.push_back(
        {viewers[i], transform(g, passage->second.pose, passage->second.rotation), model.tag(i), model.birth(i)});
    leaves[i] = 1;
  });
  if (!arrivals.empty()) move(leaves, arrivals, model);
  return arrivals.size();
}

size_t adopt(std::span<const Adoption> adoptions, splatting::GaussianModel& model) {
  if (adoptions.empty()) return 0;
  std::map<int, std::pair<int, Passage>> passages;  // by the anchor that gives
  for (const Adoption& a : adoptions) passages.try_emplace(a.from, a.to, Passage(a.to_from_from));
  std::vector<Arrival> arrivals;
  std::vector<uint8_t> leaves(model.index_end(), 0);
  model.for_each([&](size_t i) {
    const auto found = passages.find(model.anchor(i));
    if (found == passages.end()) return;
    const auto& [to, passage] = found->second;
    arrivals.push_back({to, transform(model.get(i), passage.pose, passage.rotation), model.tag(i), model.birth(i)});
    leaves[i] = 1;
  });
  if (!arrivals.empty()) move(leaves, arrivals, model);
  return arrivals.size();
}

}  // namespace photoslam
