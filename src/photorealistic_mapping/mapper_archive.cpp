// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "base/check.h"
#include "math/archive.h"
#include "photorealistic_mapping/image_archive.h"
#include "photorealistic_mapping/photorealistic_mapper.h"

namespace photoslam {
namespace {

/// The picture a target was made from.
ImageU8 color_of(const splatting::TargetImage& target) {
  ImageU8 color(target.width(), target.height(), 3);
  const size_t pixels = target.planes().size() / 3;
  for (size_t i = 0; i < pixels; ++i) {
    for (size_t c = 0; c < 3; ++c) color.values()[3 * i + c] = target.planes()[c * pixels + i];
  }
  return color;
}

ImageU16 depth_of(const splatting::TargetImage& target) {
  if (!target.has_depth()) return {};
  ImageU16 depth(target.width(), target.height());
  std::ranges::copy(target.depth(), depth.values().begin());
  return depth;
}

ImageU8 mask_of(const splatting::TargetImage& target) {
  if (!target.has_mask()) return {};
  ImageU8 mask(target.width(), target.height(), 1);
  std::ranges::copy(target.mask(), mask.values().begin());
  return mask;
}

}  // namespace

void PoseAdjustment::serialize(Archive& a) { a(correction_, first_moment_, second_moment_, steps_); }

void ExposureAdjustment::serialize(Archive& a) {
  for (size_t i = 0; i < parameters_.size(); ++i) a(parameters_[i], first_moment_[i], second_moment_[i]);
  a(steps_);
}

void KeyframeSchedule::serialize(Archive& a) {
  a(random_, uses_, losses_, active_, round_, revisits_, newest_came_last_);
}

/// `mask` is that of most views.
void PhotorealisticMapper::serialize_view(Archive& a, const ImageU8& mask, TrainingView* view) {
  ImageU8 color, own_mask;
  ImageU16 depth;
  bool has_own_mask = false;
  double depth_unit = 0;
  if (!a.reading() && view->has_images()) {
    color = color_of(view->target);
    depth = depth_of(view->target);
    depth_unit = view->metres_per_depth_unit;
    has_own_mask = !std::ranges::equal(view->target.mask(), mask.values());
    if (has_own_mask) own_mask = mask_of(view->target);
  }
  serialize_image(a, color);
  serialize_image(a, depth);
  a(depth_unit, has_own_mask);
  serialize_image(a, own_mask);
  if (a.reading()) {
    view = &views_.emplace_back();
    if (!color.empty()) set_images(color, depth, depth_unit, has_own_mask ? own_mask : mask, *view);
  }
  a(view->adjustment, view->exposure, view->exposure_is_known, view->lacks_depth);
  if (depth.empty()) serialize_image(a, view->picture.depth);  // otherwise it follows from the depth image
  serialize_image(a, view->right);
}

void PhotorealisticMapper::serialize(Archive& a) {
  wholeness_.check(kName);
  uint64_t num_views = views_.size();
  a(random_, schedule_, model_, anchors_from_world_, anchor_scales_, scene_depth_, iteration_, swept_at_,
    training_psnr_, num_corrections_, num_views);
  ImageU8 mask = sensor_.mask;
  serialize_image(a, mask);
  if (a.reading()) views_.clear();
  for (uint64_t i = 0; i < num_views; ++i) serialize_view(a, mask, a.reading() ? nullptr : &views_[i]);
}

}  // namespace photoslam
