// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/euroc_source.h"

#include "sources/calibration/calibration.h"
#include "sources/calibration/euroc_sensor.h"
#include "sources/image_list_source.h"
#include "sources/sensor_choice.h"
#include "sources/timed_list.h"

namespace photoslam::internal {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kLargestTimeDifference = 5'000'000;  // ns

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

Result<ImageList> list_images(const fs::path& camera_folder) {
  return read_image_list(camera_folder / "data.csv", TimeUnit::nanoseconds, camera_folder / "data");
}

Result<std::vector<ListedFrame>> list_frames(const fs::path& folder, SensorKind sensor,
                                             std::vector<std::string>& notes) {
  const Result<ImageList> left = list_images(folder / "cam0");
  if (!left) return left.error();
  std::vector<ListedFrame> frames;
  if (sensor == SensorKind::mono) {
    for (size_t i = 0; i < left->times.size(); ++i) frames.push_back({left->times[i], left->paths[i], {}, {}});
    return frames;
  }
  const Result<ImageList> right = list_images(folder / "cam1");
  if (!right) return right.error();
  const auto pairs =
      match_image_lists(*left, *right, kLargestTimeDifference, "images of cam0 have no partner in cam1", notes);
  if (!pairs) return error("{}: {}", folder.string(), pairs.error().message);
  for (const auto& [i, j] : *pairs) frames.push_back({left->times[i], left->paths[i], {}, right->paths[j]});
  return frames;
}

/// Fills in camera, distortion, right camera and frame rate.
Status calibrate(const fs::path& folder, const fs::path& camera_file, SourceInfo& info) {
  if (!camera_file.empty()) {
    const Result<CameraFile> file = read_calibration(camera_file);
    if (!file) return file.error();
    return apply_camera(*file, camera_file.string(), info);
  }
  const Result<EurocSensor> left = read_euroc_sensor(folder / "cam0" / "sensor.yaml");
  if (!left) return left.error();
  info.camera = left->file.camera;
  info.distortion = left->file.distortion;
  info.frames_per_second = left->file.frames_per_second.value_or(0);
  if (info.sensor == SensorKind::stereo) {
    const Result<EurocSensor> right = read_euroc_sensor(folder / "cam1" / "sensor.yaml");
    if (!right) return right.error();
    info.right = RightCamera{right->file.camera, right->file.distortion,
                             right->body_from_camera.inverse() * left->body_from_camera};
  }
  return {};
}

}  // namespace

std::optional<fs::path> find_euroc_folder(const fs::path& folder) {
  for (const fs::path& candidate : {folder / "mav0", folder}) {
    if (is_file(candidate / "cam0" / "data.csv")) return candidate;
  }
  return std::nullopt;
}

bool looks_like_euroc(const fs::path& folder) { return find_euroc_folder(folder).has_value(); }

Result<std::unique_ptr<FrameSource>> open_euroc(const fs::path& path, const SourceOptions& options) {
  const std::optional<fs::path> folder = find_euroc_folder(path);
  if (!folder) return error("{} has neither mav0/cam0/data.csv nor cam0/data.csv", path.string());
  SourceInfo info;
  info.format = "euroc";
  const fs::path whole = fs::weakly_canonical(*folder);
  const fs::path name = whole.filename() == "mav0" ? whole.parent_path().filename() : whole.filename();
  info.name = fmt::format("{} (EuRoC)", name.string());
  std::vector<SensorKind> available;
  if (is_file(*folder / "cam1" / "data.csv")) available.push_back(SensorKind::stereo);
  available.push_back(SensorKind::mono);
  const Result<SensorKind> sensor = choose_sensor(options.sensor, available, info.name);
  if (!sensor) return sensor.error();
  info.sensor = *sensor;
  if (const Status status = calibrate(*folder, options.camera, info); !status) return status.error();
  Result<std::vector<ListedFrame>> frames = list_frames(*folder, info.sensor, info.notes);
  if (!frames) return frames.error();
  return make_image_list_source(std::move(info), std::move(*frames));
}

}  // namespace photoslam::internal
