// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "camera/pinhole.h"
#include "math/sim3.h"
#include "splatting/model.h"
#include "splatting/renderer.h"
#include "splatting/view.h"

namespace photoslam {

/// The keyframe that showed each gaussian last: had it in its picture, and not behind what is rendered there.
class LastViewers {
 public:
  explicit LastViewers(const splatting::GaussianModel& model) : model_(model), viewers_(model.index_end(), kNobody) {}

  /// Takes over what one more keyframe shows; `render` is of the same camera and poses [anchors].
  void show(int keyframe, const PinholeCamera& camera, std::span<const splatting::Pose> camera_from_anchor,
            const splatting::RenderResult& render);
  /// kNobody where none did.
  int operator[](size_t gaussian) const { return viewers_[gaussian]; }

  static constexpr int kNobody = -1;

 private:
  const splatting::GaussianModel& model_;
  std::vector<int> viewers_;  // [index_end]
};

/// When a place is passed again with drift, training shifts and recolours what the first pass left there until it fits
/// the second: such gaussians live in the frame of an old keyframe, but belong into the pictures of the new one. Those
/// that a correction would move by more than `min_shift_px` in the picture of their last viewer get it as their anchor,
/// and stay where they are in its picture.
///
/// `before`, `after`: [anchors] anchor_from_world() around the correction; the model is that of before. Returns how
/// many changed hands; their optimiser state starts anew.
size_t hand_over(double min_shift_px, const PinholeCamera& camera, std::span<const Sim3> before,
                 std::span<const Sim3> after, const LastViewers& viewers, splatting::GaussianModel& model);

/// One anchor takes over all that another has.
struct Adoption {
  int from, to;
  SE3 to_from_from;  ///< In present units.
};

/// Gaussians stay where they are in the world; their optimiser state starts anew. Returns how many changed hands.
size_t adopt(std::span<const Adoption> adoptions, splatting::GaussianModel& model);

}  // namespace photoslam
