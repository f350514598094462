// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/kitti_source.h"

#include <algorithm>

#include "sources/calibration/calibration.h"
#include "sources/calibration/kitti_calib.h"
#include "sources/image_list_source.h"
#include "sources/sensor_choice.h"
#include "sources/timed_list.h"

namespace photoslam::internal {
namespace {

namespace fs = std::filesystem;

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

fs::path image_folder(const fs::path& sequence, int camera) { return sequence / fmt::format("image_{}", camera); }

bool is_sequence(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_regular_file(folder / "calib.txt", ignored) &&
         (is_folder(image_folder(folder, 0)) || is_folder(image_folder(folder, 2)));
}

KittiSequence describe(const fs::path& folder) {
  const fs::path whole = fs::weakly_canonical(folder);
  const fs::path poses = whole.parent_path().parent_path() / "poses" / (whole.filename().string() + ".txt");
  return {folder, poses, is_folder(image_folder(folder, 2)) ? 2 : 0};
}

std::vector<fs::path> sequences_below(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code code;
  for (const fs::path& parent : {folder / "sequences", folder / "dataset" / "sequences", folder}) {
    for (const auto& entry : fs::directory_iterator(parent, code)) {
      if (is_sequence(entry.path())) found.push_back(entry.path());
    }
    if (!found.empty()) break;
  }
  std::ranges::sort(found);
  return found;
}

Result<KittiCamera> find_camera(const std::map<int, KittiCamera>& cameras, int number, const fs::path& path) {
  const auto found = cameras.find(number);
  if (found == cameras.end()) return error("{} has no line 'P{}: …'", path.string(), number);
  return found->second;
}

/// Image n of a camera; KITTI names are six digits.
fs::path image_path(const KittiSequence& sequence, int camera, size_t n) {
  return image_folder(sequence.folder, camera) / fmt::format("{:06}.png", n);
}

Result<std::vector<ListedFrame>> list_frames(const KittiSequence& sequence, SensorKind sensor) {
  const fs::path times = sequence.folder / "times.txt";
  std::vector<ListedFrame> frames;
  const Status status = read_timed_list(times, TimeUnit::seconds, 1, "time", [&](int64_t time, const TextLine&) {
    const size_t n = frames.size();
    ListedFrame frame{time, image_path(sequence, sequence.left_camera, n), {}, {}};
    if (sensor == SensorKind::stereo) frame.right = image_path(sequence, sequence.left_camera + 1, n);
    frames.push_back(std::move(frame));
  });
  if (!status) return status.error();
  return frames;
}

}  // namespace

Result<KittiSequence> find_kitti_sequence(const fs::path& folder) {
  if (is_sequence(folder)) return describe(folder);
  const std::vector<fs::path> found = sequences_below(folder);
  if (found.size() == 1) return describe(found.front());
  if (found.empty()) return error("{} has no KITTI sequence: calib.txt beside image_0 or image_2", folder.string());
  std::string names;
  for (const fs::path& path : found) names += (names.empty() ? "" : ", ") + path.filename().string();
  return error("{} holds the sequences {}; name one of them, as in {}", folder.string(), names, found.front().string());
}

Result<SE3> read_kitti_camera_from_cam0(const KittiSequence& sequence) {
  const fs::path path = sequence.folder / "calib.txt";
  const auto cameras = read_kitti_calib(path);
  if (!cameras) return cameras.error();
  const Result<KittiCamera> camera = find_camera(*cameras, sequence.left_camera, path);
  if (!camera) return camera.error();
  return SE3(Quat::Identity(), camera->camera_from_cam0);
}

bool looks_like_kitti(const fs::path& folder) { return is_sequence(folder) || !sequences_below(folder).empty(); }

Result<std::unique_ptr<FrameSource>> open_kitti(const fs::path& folder, const SourceOptions& options) {
  const Result<KittiSequence> sequence = find_kitti_sequence(folder);
  if (!sequence) return sequence.error();
  SourceInfo info;
  info.format = "kitti";
  info.name = fmt::format("{} (KITTI)", fs::weakly_canonical(sequence->folder).filename().string());
  std::vector<SensorKind> available;
  if (is_folder(image_folder(sequence->folder, sequence->left_camera + 1))) available.push_back(SensorKind::stereo);
  available.push_back(SensorKind::mono);
  const Result<SensorKind> sensor = choose_sensor(options.sensor, available, info.name);
  if (!sensor) return sensor.error();
  info.sensor = *sensor;
  Result<std::vector<ListedFrame>> frames = list_frames(*sequence, info.sensor);
  if (!frames) return frames.error();

  if (!options.camera.empty()) {
    const Result<CameraFile> file = read_calibration(options.camera);
    if (!file) return file.error();
    if (Status status = apply_camera(*file, options.camera.string(), info); !status) return status.error();
    return make_image_list_source(std::move(info), std::move(*frames));
  }
  const fs::path calib = sequence->folder / "calib.txt";
  const auto cameras = read_kitti_calib(calib);
  if (!cameras) return cameras.error();
  const Result<KittiCamera> left = find_camera(*cameras, sequence->left_camera, calib);
  if (!left) return left.error();
  const auto pinhole = [](const KittiCamera& camera) {
    return PinholeCamera{0, 0, camera.fx, camera.fy, camera.cx, camera.cy};  // calib.txt does not tell the size
  };
  info.camera = pinhole(*left);
  if (info.sensor == SensorKind::stereo) {
    const Result<KittiCamera> right = find_camera(*cameras, sequence->left_camera + 1, calib);
    if (!right) return right.error();
    info.right =
        RightCamera{pinhole(*right), {}, SE3(Quat::Identity(), right->camera_from_cam0 - left->camera_from_cam0)};
  }
  return make_image_list_source(std::move(info), std::move(*frames));
}

}  // namespace photoslam::internal
