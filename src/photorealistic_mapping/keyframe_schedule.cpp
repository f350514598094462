// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/keyframe_schedule.h"

#include <algorithm>
#include <limits>

#include "base/check.h"

namespace photoslam {

namespace {

/// The first level on which a picture has no more pixels than this, or the last one.
int first_level_within(int64_t pixels, int width, int height, int last) {
  int level = 0;
  while (level < last && int64_t{width >> level} * (height >> level) > pixels) ++level;
  return level;
}

}  // namespace

void ScheduleOptions::visit(OptionVisitor& v) {
  v.value({"start_pixels", "", 1, 1000000000,
           "Training of a keyframe starts on the first level whose pictures have no more pixels than this …"},
          start_pixels);
  v.value({"pyramid_levels", "", 0, 3, "… but at most so many levels above the full image; n in Eq. (5)."},
          pyramid_levels);
  v.value({"uses_per_level", "", 1, 1000, "Training steps of a keyframe before it moves to the next finer level."},
          uses_per_level);
  v.value({"online_pixels", "", 1, 1000000000,
           "While frames arrive, the finest level is the first whose pictures have no more pixels than this."},
          online_pixels);
  v.value({"online_uses", "", 0, 1000000,
           "… and the next finer one after each so many training steps of the keyframe; 0: never."},
          online_uses);
  v.value({"newest_probability", "", 0.0, 1.0, "Share of the steps that go to the newest keyframe."},
          newest_probability);
  v.value({"worse_probability", "", 0.0, 1.0,
           "Share of the steps that go to the keyframe of larger loss out of two drawn at random."},
          worse_probability);
  v.value(
      {"seam_px", "px", 0.0, 1000.0,
       "A keyframe is trained next when a correction of the map moves what its neighbours show by more than this in "
       "its picture …"},
      seam_px);
  v.value({"seam_uses", "", 0, 1000, "… so many times."}, seam_uses);
}

KeyframeSchedule::KeyframeSchedule(const ScheduleOptions& options, int width, int height, uint64_t seed)
    : options_(options),
      coarsest_level_(first_level_within(options.start_pixels, width, height, options.pyramid_levels)),
      online_level_(first_level_within(options.online_pixels, width, height, coarsest_level_)),
      random_(seed) {}

void KeyframeSchedule::add_view() {
  active_.push_back(num_views());
  uses_.push_back(0);
  losses_.push_back(std::numeric_limits<double>::max());
}

void KeyframeSchedule::retire(int view) {
  std::erase(active_, view);
  std::erase(round_, view);
  std::erase(revisits_, view);
}

void KeyframeSchedule::append(const KeyframeSchedule& other) {
  for (const int view : other.active_) active_.push_back(num_views() + view);
  uses_.insert(uses_.end(), other.uses_.begin(), other.uses_.end());
  losses_.insert(losses_.end(), other.losses_.begin(), other.losses_.end());
}

void KeyframeSchedule::revisit(std::span<const int> views) {
  for (const int view : views) {
    if (!std::ranges::binary_search(active_, view)) continue;
    std::erase(revisits_, view);
    revisits_.insert(revisits_.end(), static_cast<size_t>(options_.seam_uses), view);
  }
}

/// Takes one out at random.
int KeyframeSchedule::take(std::vector<int>& views) {
  const auto position = static_cast<size_t>(random_.index(static_cast<int>(views.size())));
  const int view = views[position];
  views[position] = views.back();
  views.pop_back();
  return view;
}

int KeyframeSchedule::draw() {
  if (round_.empty()) round_ = active_;
  return take(round_);
}

int KeyframeSchedule::draw_worse() {
  const auto draw_any = [&] { return active_[static_cast<size_t>(random_.index(static_cast<int>(active_.size())))]; };
  const int a = draw_any(), b = draw_any();
  return losses_[static_cast<size_t>(a)] >= losses_[static_cast<size_t>(b)] ? a : b;
}

/// While seams are revisited: what the camera sees now must not wait for them.
bool KeyframeSchedule::newest_is_due() const {
  const int wanted = options_.uses_per_level * (coarsest_level_ - online_level_ + 1);
  return !newest_came_last_ && uses(active_.back()) < wanted;
}

KeyframeSchedule::Choice KeyframeSchedule::next(bool refining) {
  PHOTOSLAM_CHECK(!active_.empty());
  Choice choice;
  if (is_revisiting() && !refining && newest_is_due()) {
    choice.view = active_.back();
  } else if (is_revisiting()) {
    choice.view = take(revisits_);
  } else if (!refining && random_.uniform() < options_.newest_probability) {
    choice.view = active_.back();
  } else {
    const bool worse = options_.worse_probability > 0 && random_.uniform() < options_.worse_probability;
    choice.view = worse ? draw_worse() : draw();
  }
  newest_came_last_ = choice.view == active_.back();
  int& uses = uses_[static_cast<size_t>(choice.view)];
  int finest = refining ? 0 : online_level_;
  if (options_.online_uses > 0) finest = std::max(0, finest - uses / options_.online_uses);
  choice.level = std::max(finest, coarsest_level_ - uses / options_.uses_per_level);
  ++uses;
  return choice;
}

}  // namespace photoslam
