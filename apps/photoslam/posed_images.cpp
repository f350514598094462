// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "posed_images.h"

#include <utility>

#include "image/convert.h"
#include "io/gaussian_ply.h"
#include "io/image_file.h"
#include "run_folder.h"
#include "run_images.h"
#include "sources/common_camera.h"

namespace photoslam {

namespace fs = std::filesystem;

Result<PosedImages> read_posed_images(const fs::path& input) {
  PosedImages result;
  Result<std::vector<PosedCamera>> cameras = std::vector<PosedCamera>{};
  if (!fs::is_directory(input)) {
    cameras = read_transforms_json(input);
  } else if (fs::exists(input / "transforms.json")) {
    cameras = read_transforms_json(input / "transforms.json");
  } else if (const fs::path model = find_colmap_model(input); !model.empty()) {
    cameras = read_colmap_cameras(model, input / "images");
    auto points = read_colmap_points(model);
    if (!points) return points.error();
    result.points = std::move(*points);
  } else {
    return error("{}: found neither transforms.json nor a COLMAP model (sparse/0/images.bin or images.txt)",
                 input.string());
  }
  if (!cameras) return cameras.error();
  result.camera = cameras->front().camera;
  CommonCamera common(result.camera);
  for (const PosedCamera& posed : *cameras) {
    auto image = read_image(posed.image);
    if (!image) return image.error();
    auto picture = common.take(posed, std::move(*image));
    if (!picture) return picture.error();
    result.poses.push_back(posed.camera_from_world);
    result.images.push_back(to_rgb(picture->color));
    result.masks.push_back(std::move(picture->mask));
    result.exposures.emplace_back();
    result.num_resampled += posed.camera != result.camera || !posed.distortion.none();
  }
  return result;
}

Result<PosedImages> read_keyframes_of_run(const fs::path& run) {
  PosedImages result;
  const auto exposures = read_run_exposures(run);
  if (!exposures) return exposures.error();
  const auto add = [&](const KeyframeImage& keyframe) -> Status {
    result.camera = keyframe.camera.camera;
    result.poses.push_back(keyframe.camera.camera_from_world);
    result.images.push_back(to_rgb(keyframe.image));
    result.masks.push_back(keyframe.mask);
    result.times_ns.push_back(keyframe.timestamp_ns);
    auto& exposure = result.exposures.emplace_back();
    if (!exposures->empty()) exposure = nearest_exposure(*exposures, keyframe.timestamp_ns);
    return {};
  };
  if (Status status = for_each_keyframe_image(run, add); !status) return status.error();
  const auto map = read_gaussian_ply(run / "map.ply");
  if (!map) return map.error();
  result.points = sparse_points(*map);
  if (result.poses.empty()) return error("{}: no keyframes whose images can still be read", run.string());
  return result;
}

}  // namespace photoslam
