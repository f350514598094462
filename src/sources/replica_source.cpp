// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/replica_source.h"

#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "sources/calibration/calibration.h"
#include "sources/image_list_source.h"
#include "sources/sensor_choice.h"

namespace photoslam::internal {
namespace {

namespace fs = std::filesystem;

/// The number n of a file named <prefix>n<extension>.
std::optional<int64_t> numbered(const fs::path& path, std::string_view prefix) {
  const std::string stem = path.stem().string();
  if (!stem.starts_with(prefix)) return std::nullopt;
  int64_t number = 0;
  const char* const last = stem.data() + stem.size();
  const auto [end, code] = std::from_chars(stem.data() + prefix.size(), last, number);
  constexpr int64_t kLargest = 100'000'000;
  if (code != std::errc() || end != last || number < 0 || number > kLargest) return std::nullopt;
  return number;
}

bool is_color_file(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png";
}

/// The folder with the images: results/ of the scene, or the folder itself.
fs::path image_folder(const fs::path& folder) {
  return fs::is_directory(folder / "results") ? folder / "results" : folder;
}

fs::path scene_folder(const fs::path& folder) {
  const fs::path whole = fs::weakly_canonical(folder);
  return whole.filename() == "results" ? whole.parent_path() : whole;
}

/// Depth files whose colour image is missing make no frame.
std::vector<ListedFrame> list_frames(const fs::path& images, SensorKind sensor) {
  std::map<int64_t, fs::path> colors;
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(images, code)) {
    const std::optional<int64_t> number = numbered(entry.path(), "frame");
    if (number && is_color_file(entry.path())) colors.emplace(*number, entry.path());
  }
  std::vector<ListedFrame> frames;
  for (const auto& [number, color] : colors) {
    const std::string digits = color.stem().string().substr(std::string_view("frame").size());
    ListedFrame frame{replica_time_ns(number), color, {}, {}};
    if (sensor == SensorKind::rgbd) frame.depth = images / fmt::format("depth{}.png", digits);
    frames.push_back(std::move(frame));
  }
  return frames;
}

/// A positive number of the JSON object, or NaN.
double positive(const nlohmann::json& object, const char* key) {
  const auto entry = object.find(key);
  if (entry == object.end() || !entry->is_number()) return std::nan("");
  const double value = entry->get<double>();
  return value > 0 && value < 1e6 ? value : std::nan("");
}

Result<CameraFile> read_cam_params(const fs::path& path) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  const nlohmann::json root = nlohmann::json::parse(*content, nullptr, /*allow_exceptions=*/false);
  if (!root.is_object()) return error("{} is not a JSON object", path.string());
  const auto camera = root.find("camera");
  if (camera == root.end() || !camera->is_object()) return error("{} has no object 'camera'", path.string());

  std::array<double, 7> values{};
  constexpr std::array<const char*, 7> kKeys = {"w", "h", "fx", "fy", "cx", "cy", "scale"};
  for (size_t i = 0; i < kKeys.size(); ++i) {
    values[i] = positive(*camera, kKeys[i]);
    if (std::isnan(values[i])) return error("{}: camera.{} must be a positive number", path.string(), kKeys[i]);
  }
  CameraFile file;
  file.camera = {static_cast<int>(values[0]), static_cast<int>(values[1]), values[2], values[3], values[4], values[5]};
  file.depth_scale = values[6];
  return file;
}

Result<CameraFile> find_camera(const fs::path& scene, const fs::path& chosen) {
  if (!chosen.empty()) return read_calibration(chosen);
  for (const fs::path& path : {scene / "cam_params.json", scene.parent_path() / "cam_params.json"}) {
    if (fs::exists(path)) return read_cam_params(path);
  }
  if (fs::exists(scene / "camera.yaml")) return read_camera_yaml(scene / "camera.yaml");
  return error("neither {} nor its parent has cam_params.json; copy it there, or name a camera.yaml with --camera",
               scene.string());
}

}  // namespace

bool looks_like_replica(const fs::path& folder) {
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(image_folder(folder), code)) {
    if (numbered(entry.path(), "frame") && is_color_file(entry.path())) return true;
  }
  return false;
}

Result<std::unique_ptr<FrameSource>> open_replica(const fs::path& folder, const SourceOptions& options) {
  const Result<CameraFile> camera = find_camera(scene_folder(folder), options.camera);
  if (!camera) return camera.error();
  const fs::path images = image_folder(folder);
  const std::string name = fmt::format("{} (Replica)", scene_folder(folder).filename().string());
  constexpr std::array<SensorKind, 2> kAvailable = {SensorKind::rgbd, SensorKind::mono};
  const Result<SensorKind> sensor = choose_sensor(options.sensor, kAvailable, name);
  if (!sensor) return sensor.error();
  std::vector<ListedFrame> frames = list_frames(images, *sensor);
  if (frames.empty()) return error("{} has no images named frame000000.jpg", images.string());

  SourceInfo info;
  info.format = "replica";
  info.name = name;
  info.sensor = *sensor;
  info.camera = camera->camera;
  info.distortion = camera->distortion;
  constexpr double kDefaultDepthScale = 6553.5;
  if (info.sensor == SensorKind::rgbd) set_depth_unit(camera->depth_scale, kDefaultDepthScale, info);
  info.frames_per_second = kReplicaFramesPerSecond;
  return make_image_list_source(std::move(info), std::move(frames));
}

}  // namespace photoslam::internal
