// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_rectifier.h"

#include <vector>

#include "image/rectification.h"

namespace photoslam {
namespace {

using splatting::cuda::DeviceLens;
using splatting::cuda::DevicePicture;

DeviceLens device_lens(const Undistorter& lens) {
  return {lens.lens().width, lens.lens().height, lens.taps().data(), lens.camera().width, lens.camera().height};
}

/// What becomes of the pictures of a frame on the GPU.
class Batch {
 public:
  /// Fills `target`, which has to stay where it is; nothing is to be done with an empty picture.
  template <class T>
  void add(int lens, const Undistorter& undistorter, const Image<T>& raw, Image<T>& target) {
    if (raw.empty()) return;
    undistorter.check_fits(raw);
    target = Image<T>(undistorter.camera().width, undistorter.camera().height, raw.channels());
    using Kind = DevicePicture::Kind;
    const Kind kind = sizeof(T) == 2 ? Kind::depth : raw.channels() == 3 ? Kind::rgb : Kind::grey;
    pictures_.push_back({lens, kind, raw.values().data(), target.values().data()});
  }
  std::span<const DevicePicture> pictures() const { return pictures_; }

 private:
  std::vector<DevicePicture> pictures_;
};

}  // namespace

FrameRectifier::FrameRectifier(const SourceInfo& info, const splatting::Gpu* gpu) : camera_(info.camera) {
  if (info.sensor == SensorKind::stereo) {
    PHOTOSLAM_CHECK(info.right.has_value(), "{}: a stereo source without a right camera", info.name);
    const StereoRectification r = rectify_stereo(
        {info.camera, info.distortion}, {info.right->camera, info.right->distortion}, info.right->right_from_left);
    camera_ = r.camera;
    baseline_m_ = r.baseline_m;
    rectified_from_left_ = r.rectified_from_left;
    if (r.is_identity) return;
    left_.emplace(info.camera, info.distortion, r.camera, r.rectified_from_left);
    right_.emplace(info.right->camera, info.right->distortion, r.camera, r.rectified_from_right);
  } else if (!info.distortion.none()) {
    left_.emplace(info.camera, info.distortion);
  }
  if (gpu == nullptr || !left_) return;
  std::vector<DeviceLens> lenses = {device_lens(*left_)};
  if (right_) lenses.push_back(device_lens(*right_));
  gpu_ = gpu->make_undistorter(lenses);
}

FramePictures FrameRectifier::rectify(FramePictures raw) {
  if (gpu_ != nullptr && gpu_->failure().empty()) {
    FramePictures result;
    Batch batch;
    batch.add(0, *left_, raw.color, result.color);
    batch.add(0, *left_, raw.depth, result.depth);
    if (right_) batch.add(1, *right_, raw.right, result.right);
    if (gpu_->undistort(batch.pictures())) {
      if (!right_) result.right = std::move(raw.right);
      return result;
    }
  }
  return {color(std::move(raw.color)), depth(std::move(raw.depth)), right(std::move(raw.right))};
}

}  // namespace photoslam
