// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/common_camera.h"

#include <algorithm>
#include <utility>

namespace photoslam {
namespace {

constexpr size_t kMaxLenses = 8;

}  // namespace

const CommonCamera::Lens& CommonCamera::lens_of(const PosedCamera& posed) {
  const auto is_same = [&](const Lens& l) { return l.camera == posed.camera && l.distortion == posed.distortion; };
  if (const auto known = std::ranges::find_if(lenses_, is_same); known != lenses_.end()) return *known;
  if (lenses_.size() == kMaxLenses) lenses_.erase(lenses_.begin());
  auto undistorter = std::make_unique<const Undistorter>(posed.camera, posed.distortion, camera_, Quat::Identity());
  const ImageU8& mask = undistorter->mask();
  const auto blind = std::ranges::count(mask.values(), 0);
  Lens lens{posed.camera, posed.distortion, blind < std::ssize(mask.values()), nullptr, nullptr};
  if (blind > 0) lens.mask = std::make_shared<const ImageU8>(mask);
  lens.undistorter = std::move(undistorter);
  lenses_.push_back(std::move(lens));
  return lenses_.back();
}

Result<CommonCamera::Picture> CommonCamera::take(const PosedCamera& posed, ImageU8 raw) {
  if (raw.width() != posed.camera.width || raw.height() != posed.camera.height) {
    return error("{}: {}x{}, but its camera says {}x{}", posed.image.string(), raw.width(), raw.height(),
                 posed.camera.width, posed.camera.height);
  }
  if (posed.camera == camera_ && posed.distortion.none()) return Picture{std::move(raw), nullptr};
  const Lens& lens = lens_of(posed);
  if (!lens.sees) {
    return error("{}: its lens leaves nothing of the picture; check the distortion coefficients", posed.image.string());
  }
  return Picture{lens.undistorter->color(raw), lens.mask};
}

}  // namespace photoslam
